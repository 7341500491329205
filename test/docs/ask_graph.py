"""What `ros2` commands ask for, asked of the graph by a program: ask_graph.py FILE, one command per line.

Prints "found" for each: the topic with that type and the message, the node with that parameter.
"""

from __future__ import annotations

import importlib
import shlex
import sys
import time
from collections.abc import Callable
from pathlib import Path

import yaml

from automax_ros.ros.setup.environment import prepare

PATIENCE_S = 240.0


def main() -> None:
    prepare()
    import rclpy

    rclpy.init()
    node = rclpy.create_node("asker")
    for line in Path(sys.argv[1]).read_text().splitlines():
        words = [word for word in shlex.split(line.partition(" #")[0])[1:] if word not in ("--once",)]
        if "-r" in words:
            del words[words.index("-r") : words.index("-r") + 2]
        ask = {("topic", "echo"): echo, ("topic", "pub"): pub, ("param", "describe"): param, ("param", "set"): param}
        ask[words[0], words[1]](node, *words[2:])
        print("found")
    rclpy.shutdown()


def until(condition: Callable[[], object]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > deadline:
            sys.exit("it is not there")
        time.sleep(0.05)


def types(node: object, topic: str) -> list[str]:
    return dict(node.get_topic_names_and_types()).get(topic, [])


def echo(node: object, topic: str) -> None:
    until(lambda: types(node, topic))


def pub(node: object, topic: str, kind: str, text: str) -> None:
    until(lambda: types(node, topic) == [kind])
    package, _, name = kind.split("/")
    message = getattr(importlib.import_module(f"{package}.msg"), name)()
    for field, value in yaml.safe_load(text).items():
        setattr(message, field, value)  # which checks type and range


def param(node: object, name: str, parameter: str, *value: str) -> None:
    import rclpy
    from rclpy.parameter_client import AsyncParameterClient

    client = AsyncParameterClient(node, name)
    assert client.wait_for_services(PATIENCE_S)
    future = client.describe_parameters([parameter])
    rclpy.spin_until_future_complete(node, future, timeout_sec=PATIENCE_S)
    described = future.result().descriptors[0]
    assert described.name == parameter
    for bounds in described.floating_point_range:
        assert all(bounds.from_value <= float(item) <= bounds.to_value for item in value)


if __name__ == "__main__":
    main()
