"""Input and output of subcommands: files, the terminal, pictures; and signals."""
