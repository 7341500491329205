"""What all tests share: a ROS 2 environment that stays on this machine, and a domain of its own for each test."""

import itertools
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from ros_domains import free_domain

from automax_ros.ros.setup.discovery import announce_soon
from automax_ros.ros.setup.environment import put_prefix_first

# No test talks to, or hears, the plant's network.
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
for inherited in ("ROS_STATIC_PEERS", "ROS_NAMESPACE", "RMW_IMPLEMENTATION", "FASTRTPS_DEFAULT_PROFILES_FILE"):
    os.environ.pop(inherited, None)
put_prefix_first()

# An example may take as long as a busy host lets it. `make test` tries the same ones each time, `make soak` new ones.
settings.register_profile("soak", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("tests", settings.get_profile("soak"), derandomize=True)

# A shell that starts the tests in the background lets them ignore Ctrl-C; programs that they start would, too.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_configure(config: pytest.Config) -> None:
    """Choose how examples are drawn."""
    settings.load_profile("soak" if config.option.markexpr == "soak" else "tests")


@pytest.hookimpl(trylast=True)  # after those that leave tests out
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let files with tests of running racks, which wait much, alternate with others, the longest ones first.

    So the cores have work while racks run, racks are not measured next to too many others, and all workers end
    together.
    """
    files: dict[Path, list[pytest.Item]] = {}
    for item in items:
        files.setdefault(item.path, []).append(item)
    longest_first = sorted(files, key=lambda path: (-len(files[path]), path))
    racks = [
        path
        for path in longest_first
        if path.is_relative_to(Path(__file__).parent / "system") or path.name == "test_live_examples.py"
    ]
    others = [path for path in longest_first if path not in racks]
    order = itertools.chain.from_iterable(itertools.zip_longest(racks, others))
    items[:] = [item for path in order if path is not None for item in files[path]]


@pytest.fixture(autouse=True)
def this_host_alone() -> Iterator[None]:
    """A program that a test runs in its own process may have chosen another range: no other test shall have it."""
    yield
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    for chosen in (
        "ROS_LOCALHOST_ONLY",
        "ROS_STATIC_PEERS",
        "FASTRTPS_DEFAULT_PROFILES_FILE",
        "FASTDDS_BUILTIN_TRANSPORTS",
    ):
        os.environ.pop(chosen, None)


@pytest.fixture
def ros_domain_id(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A ROS domain of the test's own, set as ROS_DOMAIN_ID; child processes inherit it."""
    with free_domain() as domain:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        announce_soon()
        yield domain


@pytest.fixture(scope="module")
def module_domain_id() -> Iterator[int]:
    """The same for all tests of a module together, which may then share a running rack."""
    with free_domain() as domain, pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(domain))
        yield domain
