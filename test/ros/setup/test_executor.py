"""Nodes leave an executor that a thread of somebody else's spins: none is destroyed while the thread uses it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import pytest
from rclpy.context import Context
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from system.support import wait_until

from automax_ros.ros.setup.process import take_out

LIMIT_S = 240.0


class Watched(Node):
    """Tells when an executor looks at what it has, and holds it there once."""

    def __init__(self, context: Context) -> None:
        self.looks = 0
        self.looked, self.goes_on = threading.Event(), threading.Event()
        super().__init__("watched", context=context, enable_rosout=False)

    @property
    def waitables(self) -> Iterator[Any]:
        self.looks += 1
        self.looked.set()
        assert self.goes_on.wait(LIMIT_S)
        return super().waitables


@pytest.fixture(params=[SingleThreadedExecutor, lambda context: MultiThreadedExecutor(2, context=context)])
def executor(request, context):
    made = request.param(context=context)
    yield made
    made.shutdown()


def test_nodes_are_let_go_of_before_they_may_be_destroyed(context, executor, monkeypatch):
    monkeypatch.setattr("automax_ros.ros.setup.process._ANSWER_S", LIMIT_S)  # however slow the host is
    node, ended, failed = Watched(context), threading.Event(), []

    def spin():
        try:
            while not ended.is_set():
                executor.spin_once(timeout_sec=0.05)
        except Exception as error:
            failed.append(error)

    executor.add_node(node)
    spinning = threading.Thread(target=spin)
    spinning.start()
    assert node.looked.wait(LIMIT_S)
    leaving = threading.Thread(target=take_out, args=(executor, [node]))
    leaving.start()
    wait_until(lambda: node not in executor.get_nodes())
    assert leaving.is_alive(), "the executor is in the middle of the node's things"
    node.goes_on.set()
    leaving.join(LIMIT_S)
    looks = node.looks
    node.destroy_node()
    for _ in range(3):
        passed = threading.Event()
        executor.create_task(passed.set)
        assert passed.wait(LIMIT_S)
    ended.set()
    spinning.join()
    assert (node.looks, failed) == (looks, [])


def test_executor_that_nobody_spins_is_not_waited_for(context, executor):
    node = Watched(context)
    node.goes_on.set()
    executor.add_node(node)
    take_out(executor, [node])
    assert executor.get_nodes() == []
    executor.shutdown()
    take_out(executor, [node])
    node.destroy_node()
    assert node.looks == 0
