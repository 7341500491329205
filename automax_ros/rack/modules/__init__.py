"""The kinds of modules, one file each: catalogue numbers, keys, places, registers, tasks, what survives, state.

- ``kind`` says what a kind of module is, to the loader and to the rack;
- ``processor``, ``common_memory``, ``digital_io``, ``analog_io``, ``resolver``, ``pulsetach`` are the kinds;
- ``io_config`` has what the kinds without keys and tasks share;
- ``registry`` is the one list of them, and says why other modules of the catalogue cannot be used.
"""
