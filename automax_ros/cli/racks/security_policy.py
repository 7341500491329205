"""Write the SROS 2 policy of a rack: who may publish and subscribe to what, and with --keystore the keys for it.

The nodes are made, asked what they open, and destroyed; nothing runs. The policy has an enclave for the rack (with
--distributed one for each process), one for those who record and watch, and one for those who operate. Without --output
it is printed.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from automax_ros.cli.options.rack import add_outside_argument, config_of, print_refused
from automax_ros.cli.options.ros import add_ros_arguments, prepare_ros, ros_arguments
from automax_ros.core.user_error import UsageError
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.processes import processes_of

if TYPE_CHECKING:
    from automax_ros.ros.security.profiles import Enclave

POLICY, KEYSTORE = "policy.xml", "keystore"
"""The contents of the folder of ``--output``."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax security-policy``."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="the rack's YAML file, or its folder")
    parser.add_argument("--output", type=Path, metavar="DIR", help=f"write {POLICY} into this folder")
    parser.add_argument(
        "--keystore",
        action="store_true",
        help=f"make DIR/{KEYSTORE} too, with openssl; an authority and keys that are there are kept",
    )
    parser.add_argument("--distributed", action="store_true", help="an enclave for each process of a distributed rack")
    add_outside_argument(parser)
    add_ros_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Write or print the policy; 1 where the rack has errors."""
    if arguments.keystore and arguments.output is None:
        raise UsageError("--keystore needs a folder", "give --output DIR")
    if arguments.discovery is None:
        arguments.discovery = "off"  # these nodes are only inspected, and not to be discovered
    os.environ.pop("ROS_SECURITY_ENABLE", None)  # the keys of these nodes may not be there yet
    domain = prepare_ros(arguments)
    config = config_of(arguments.config, allow_outside=arguments.allow_outside, quiet=True)
    if config is None:
        return 1
    config = replace(config, namespace=ros_arguments(arguments).placed(config.namespace))
    try:
        enclaves = _enclaves(arguments, config)
    except RackError as error:
        return print_refused("security-policy", error)
    from automax_ros.ros.security.policy import policy_text

    text = policy_text(enclaves)
    if arguments.output is None:
        sys.stdout.write(text)
        return 0
    _write(arguments.output / POLICY, text)
    if arguments.keystore:
        from automax_ros.ros.security.keystore import Keystore

        Keystore(arguments.output / KEYSTORE, domain).add(enclaves)
    print("\n".join(_what_to_do(arguments, enclaves, domain)))
    return 0


def _enclaves(arguments: argparse.Namespace, config: RackConfig) -> Sequence[Enclave]:
    from automax_ros.ros.security.profiles import enclave_of_rack, enclaves_of_processes, operator_of, recorder_of

    ros = ros_arguments(arguments)
    rack = (
        enclaves_of_processes(config, processes_of(config), ros)
        if arguments.distributed
        else (enclave_of_rack(config, ros),)
    )
    space = f"/{config.namespace}"
    return (*rack, recorder_of(space, rack), operator_of(space, rack))


def _write(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UsageError(f"{path} cannot be written: {error.strerror or error}") from error


def _what_to_do(arguments: argparse.Namespace, enclaves: Sequence[Enclave], domain: int) -> list[str]:
    folder = arguments.output
    lines = [f"{folder / POLICY}: {', '.join(enclave.path for enclave in enclaves)}"]
    if not arguments.keystore:
        lines += [
            "where ROS 2 is installed, keys for it:",
            f"  ros2 security create_keystore {folder / KEYSTORE}",
            f"  ros2 security generate_artifacts -k {folder / KEYSTORE} -p {folder / POLICY}",
        ]
    else:
        lines.append(f"{folder / KEYSTORE}: keys, certificates and signed permissions, for ROS domain {domain}")
    return [
        *lines,
        "then, in every shell:",
        f"  export ROS_SECURITY_KEYSTORE={folder / KEYSTORE} ROS_SECURITY_ENABLE=true ROS_SECURITY_STRATEGY=Enforce",
        *(f"  automax ... --ros-args --enclave {enclave.path}" for enclave in enclaves),
    ]
