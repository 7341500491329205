"""What the tests with real processes share: `automax run` as a child, and a ROS node of the test's own."""

import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any, NamedTuple

from waiting import PATIENCE_S, wait_until

from automax_ros.cli.main import main

ROOT = Path(__file__).parents[2]
RACKS = Path(__file__).parent / "racks"
TYPES = RACKS / "types" / "rack.yaml"
STUCK = RACKS / "stuck" / "rack.yaml"
COMMAND = (sys.executable, "-m", "automax_ros.cli.main")
MOST_SHOWN = 100
"""Lines of a program's output that are shown where its test fails."""


class Ended(NamedTuple):
    """How a process ended, and how long it took since it was asked to."""

    code: int
    out: str
    err: str
    seconds: float


class Automax:
    """`automax` with arguments as a child process, in a ``with`` block that leaves nothing running."""

    def __init__(self, *arguments: str | Path, environment: dict[str, str] | None = None) -> None:
        self._state = TemporaryDirectory(prefix="automax_state_")
        arguments = with_state(arguments, self._state.name)
        self.process = subprocess.Popen(
            [*COMMAND, *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=ROOT,
            env=environment,
        )
        self.began = time.monotonic()
        self.out: list[str] = []
        self.err: list[str] = []
        self._readers = [self._reader(self.process.stdout, self.out), self._reader(self.process.stderr, self.err)]

    def __enter__(self) -> "Automax":
        return self

    def __exit__(self, *error: object) -> None:
        if error and error[0] is not None:
            print(
                f"{' '.join(map(str, self.process.args))} has said:", *self.out[-MOST_SHOWN:], *self.err[-MOST_SHOWN:]
            )
        self.process.terminate()  # a process that is killed leaves its shared memory behind
        try:
            self.process.wait(10.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        for reader in self._readers:
            reader.join()
        self._state.cleanup()

    @property
    def pid(self) -> int:
        return self.process.pid

    def wait_for_line(self, text: str) -> None:
        """Wait until standard output holds a text."""
        wait_until(lambda: text in "".join(self.out) or self.process.poll() is not None)
        assert text in "".join(self.out), f"no {text!r} in {self.out}, {self.err}"

    def wait_until_catching(self, number: signal.Signals) -> None:
        """Wait until the process handles a signal itself."""
        wait_until(lambda: catches(self.pid, number), pause_s=0.001)

    def send(self, number: signal.Signals) -> None:
        self.process.send_signal(number)

    def end(self, *signals: signal.Signals) -> Ended:
        """Send signals, wait for the end and return all output."""
        asked = time.monotonic()
        for number in signals:
            self.process.send_signal(number)
        self.process.wait(PATIENCE_S)
        seconds = time.monotonic() - asked
        for reader in self._readers:
            reader.join()
        return Ended(self.process.returncode, "".join(self.out), "".join(self.err), seconds)

    @staticmethod
    def _reader(stream: IO[str] | None, lines: list[str]) -> threading.Thread:
        assert stream is not None
        thread = threading.Thread(target=lambda: lines.extend(iter(stream.readline, "")), daemon=True)
        thread.start()
        return thread


def automax(*arguments: str | Path, environment: dict[str, str] | None = None) -> Ended:
    """Run `automax` to its end."""
    with Automax(*arguments, environment=environment) as process:
        return process.end()


def with_state(arguments: tuple[str | Path, ...], folder: str) -> tuple[str | Path, ...]:
    """Return arguments with a folder for a rack's state: what one test tunes is nothing to the next."""
    keeps = arguments[0] == "run" and not {"--simulated", "--state"} & set(arguments)
    return (*arguments, "--state", folder) if keeps else arguments


def automax_here(*arguments: str | Path) -> Ended:
    """Run `automax` to its end in this process: a second quicker, where a process of its own is not what is tested."""
    began = time.monotonic()
    with TemporaryDirectory() as state, redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        code = main(list(map(str, with_state(arguments, state))))
    return Ended(code, out.getvalue(), err.getvalue(), time.monotonic() - began)


def catches(pid: int, number: signal.Signals) -> bool:
    """Whether a process handles a signal itself."""
    caught = re.search(r"^SigCgt:\s*([0-9a-f]+)", Path(f"/proc/{pid}/status").read_text(), re.MULTILINE)
    return caught is not None and bool(int(caught[1], 16) >> (number - 1) & 1)


class Client:
    """A ROS node of the test process, in its own context, spun only while the test waits.

    To find a running rack takes it up to 3 s, so tests share one and ``forget`` what they have subscribed to.
    """

    patience_s = PATIENCE_S
    """How long a condition may take."""

    def __init__(self, name: str = "client") -> None:
        from rclpy.context import Context
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node

        self.context = Context()
        self.context.init(args=["--ros-args", "--disable-stdout-logs"])
        self.node: Any = Node(name, context=self.context, enable_rosout=False)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self._subscriptions: list[Any] = []

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()

    def listen(self, kind: Any, topic: str, *, latched: bool = False, depth: int = 50_000) -> list[Any]:
        """Subscribe, and return the list to which messages are added while the client waits."""
        from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

        durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
        qos = QoSProfile(depth=depth, reliability=ReliabilityPolicy.RELIABLE, durability=durability)
        received: list[Any] = []
        self._subscriptions.append(self.node.create_subscription(kind, topic, received.append, qos))
        return received

    def forget(self) -> None:
        """End all subscriptions."""
        for subscription in self._subscriptions:
            self.node.destroy_subscription(subscription)
        self._subscriptions.clear()

    def until(self, condition: Callable[[], bool], what: str = "") -> None:
        """Serve the node until a condition is true."""
        deadline = time.monotonic() + self.patience_s
        while not condition():
            assert time.monotonic() < deadline, f"it never came true: {what or condition}"
            self.executor.spin_once(timeout_sec=0.05)
            self.look()

    def look(self) -> None:
        """Take what comes by looking, if anything does, rather than by callbacks."""

    def spin(self, seconds: float) -> None:
        """Serve the node for a while: where nothing must happen, there is no condition to wait for."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.02)
            self.look()

    def first(self, kind: Any, topic: str) -> Any:
        """Return what waits for late joiners on a latched topic."""
        received = self.listen(kind, topic, latched=True, depth=1)
        self.until(lambda: bool(received), f"a message on {topic}")
        return received[0]

    def send(self, kind: Any, topic: str, *messages: Any) -> None:
        """Publish messages once somebody listens."""
        from rclpy.duration import Duration

        publisher = self.node.create_publisher(kind, topic, 10)
        self.until(lambda: publisher.get_subscription_count() > 0, f"a subscriber of {topic}")
        for message in messages:
            publisher.publish(message)
        # A reader of a process that was killed stands in the graph for up to 20 s.
        assert publisher.wait_for_all_acked(Duration(seconds=self.patience_s)), f"{topic} was not taken"
        self.node.destroy_publisher(publisher)

    def result(self, future: Any) -> Any:
        """Wait for a service's answer."""
        self.until(future.done, "an answer")
        return future.result()


def ns(stamp: Any) -> int:
    """A ROS time in nanoseconds."""
    return int(stamp.sec * 1_000_000_000 + stamp.nanosec)


def entries(values: Any) -> list[tuple[int, int, float]]:
    """The entries of a Values message: variable, element, value."""
    return list(zip(values.variable, values.element, values.value, strict=True))


def consecutive(numbers: Sequence[int]) -> bool:
    return list(numbers) == list(range(numbers[0], numbers[0] + len(numbers)))
