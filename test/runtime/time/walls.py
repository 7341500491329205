"""A wall clock of the tests' own."""

from automax_ros.core.ticks import NS_PER_S


class Wall:
    """A wall clock that moves when somebody waits, or when a test moves it."""

    def __init__(self) -> None:
        self.now_ns = 1_000_000_007
        self.waits: list[float] = []

    def __call__(self) -> int:
        return self.now_ns

    def wait(self, seconds: float) -> None:
        self.waits.append(seconds)
        self.now_ns += round(seconds * NS_PER_S)
