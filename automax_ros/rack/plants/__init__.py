"""The ``plants`` section: the lines, bridges, motors and loads of drives, by name.

- ``config`` says what the section means, ``reading`` reads it and finds what is wrong;
- ``building`` makes the plants of a running rack.
"""
