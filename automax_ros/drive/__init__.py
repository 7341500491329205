"""The power circuit of a drive: AC line, SCR bridges, DC motor; SI units, sign conventions in ``docs/drive.md``."""
