"""Print the JSON schema of a rack file or of a stimuli file, with which editors complete and check one.

`automax schema rack > rack.schema.json`, then `# yaml-language-server: $schema=rack.schema.json` as the first line of
the file. A schema knows the form of a file; `automax check` knows what its parts mean to each other.
"""

from __future__ import annotations

import argparse
import json

from automax_ros.rackfile.loader import schema as rack_schema
from automax_ros.scenario.stimuli.schema import schema as stimuli_schema

SCHEMAS = {"rack": rack_schema, "stimuli": stimuli_schema}
"""The kinds of files, each with the function that returns its schema."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax schema``."""
    parser.add_argument("kind", choices=list(SCHEMAS), metavar="KIND", help="rack or stimuli")


def run(arguments: argparse.Namespace) -> int:
    """Print the schema."""
    print(json.dumps(SCHEMAS[arguments.kind](), indent=2))
    return 0
