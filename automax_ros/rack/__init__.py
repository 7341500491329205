"""From a YAML file to a rack: slots, modules, common variables and tasks, wired together.

- ``config`` says what a rack's file means, as frozen dataclasses;
- ``loader`` reads a file into them and finds everything wrong with it: ``load(path)``;
- ``yaml_text`` reads YAML without its dangerous parts, ``sections`` and ``scalars`` check mappings and values;
- ``slots``, ``tasks``, ``commons``, ``names``, ``presets`` check one part of the file each;
- ``modules`` is the table of AutoMax modules, ``files`` reads files within bounds;
- ``ros_names`` turns the rack's names into names of ROS 2.

docs/rack_yaml.md is the user's reference of the file.
"""
