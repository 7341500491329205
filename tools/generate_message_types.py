"""Writes automax_ros/messages/types/message_types.json: definition and hash of each message type in recordings.

python tools/generate_message_types.py, after a change in msg_defs/. The definitions of the standard types come from the
ROS 2 installed with this interpreter (or AMENT_PREFIX_PATH), the type hashes (RIHS01) from rosbags.
"""

import json
import os
import sys
from pathlib import Path

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

ROOT = Path(__file__).resolve().parent.parent
TARGET = ROOT / "automax_ros" / "messages" / "types" / "message_types.json"
OWN = "automax_msgs"
# Parts of services' answers; no recording holds them.
SERVED = frozenset({"LoggedError"})
# Tables of a rack that is live, and their lines; no recording holds them: what they show is in it in other ways.
LIVE = frozenset({"Force", "ForceTable", "ScanStatistics", "TaskStatistics"})
STANDARD = (
    "builtin_interfaces/msg/Time",
    "rosgraph_msgs/msg/Clock",
    "sensor_msgs/msg/JointState",
    "std_msgs/msg/Bool",
    "std_msgs/msg/Float32",
    "std_msgs/msg/Float32MultiArray",
    "std_msgs/msg/Float64",
    "std_msgs/msg/Float64MultiArray",
    "std_msgs/msg/Header",
    "std_msgs/msg/Int16",
    "std_msgs/msg/Int16MultiArray",
    "std_msgs/msg/Int32",
    "std_msgs/msg/Int32MultiArray",
    "std_msgs/msg/MultiArrayDimension",
    "std_msgs/msg/MultiArrayLayout",
    "std_msgs/msg/String",
    "std_msgs/msg/UInt8MultiArray",
)


def ros_prefixes() -> list[Path]:
    """Where ROS 2 packages may be installed, best first."""
    sourced = os.environ.get("AMENT_PREFIX_PATH", "")
    return [Path(sys.prefix), *(Path(prefix) for prefix in sourced.split(os.pathsep) if prefix)]


def installed_file(type_name: str, suffix: str) -> Path | None:
    """The file of a type, definition (.msg) or description (.json), in the installed ROS 2; None if there is none."""
    candidates = (prefix / "share" / f"{type_name}{suffix}" for prefix in ros_prefixes())
    return next((path for path in candidates if path.is_file()), None)


def definition_texts() -> dict[str, str]:
    """The .msg text of every type, by type name.

    Raises:
        FileNotFoundError: a standard definition is not installed.
    """
    own = [path for path in (ROOT / "msg_defs" / "msg").glob("*.msg") if path.stem not in SERVED | LIVE]
    texts = {f"{OWN}/msg/{path.stem}": path.read_text(encoding="utf-8") for path in own}
    for name in STANDARD:
        path = installed_file(name, ".msg")
        if path is None:
            raise FileNotFoundError(
                f"{name}.msg is not installed: run `make setup` and start this with .venv/bin/python"
            )
        texts[name] = path.read_text(encoding="utf-8")
    return dict(sorted(texts.items()))


def type_hashes(texts: dict[str, str]) -> dict[str, str]:
    """The RIHS01 hash of every type, by type name."""
    store = get_typestore(Stores.EMPTY)
    types = {}
    for name, text in texts.items():
        types.update(get_types_from_msg(text, name))
    store.register(types)
    return {name: store.hash_rihs01(name) for name in texts}


def generate() -> str:
    """The content of message_types.json."""
    texts = definition_texts()
    hashes = type_hashes(texts)
    table = {name: {"hash": hashes[name], "text": text} for name, text in texts.items()}
    return json.dumps(table, indent=1) + "\n"


if __name__ == "__main__":
    TARGET.write_text(generate(), encoding="utf-8")
