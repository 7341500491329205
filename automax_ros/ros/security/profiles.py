"""Who may publish and subscribe to what in a rack's graph: profiles of nodes, in enclaves.

An enclave represents one process in ROS 2 security: its certificate and its permissions. A profile has the full names
that one node needs.

The nodes are created as `automax run` creates them, in a context that reaches no other program, queried, and destroyed:
no task scans. So a policy matches the program, not a description of it (decision).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.processes import RackProcess
from automax_ros.ros.distributed.bus import ProcessLayout
from automax_ros.ros.rack_nodes import RackNodes
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments
from automax_ros.ros.setup.process import joined_context


@dataclass(frozen=True)
class Profile:
    """The topics and services that a node publishes, subscribes to, serves and calls: full names, in sorted order."""

    namespace: str
    node: str
    publish: tuple[str, ...] = ()
    subscribe: tuple[str, ...] = ()
    reply: tuple[str, ...] = ()
    request: tuple[str, ...] = ()


@dataclass(frozen=True)
class Enclave:
    """The permissions of one process; ``path`` is its argument of ``--ros-args --enclave``."""

    path: str
    profiles: tuple[Profile, ...]

    def names(self, part: str) -> tuple[str, ...]:
        """Return the names of all profiles in one of their parts, such as ``publish``, each once."""
        return tuple(sorted({name for profile in self.profiles for name in getattr(profile, part)}))


LOG, EVENTS = "/rosout", "/parameter_events"


def recorder_of(namespace: str, rack: Iterable[Enclave]) -> Enclave:
    """Return the enclave of observers and recorders, which subscribe to the rack's topics and publish nothing.

    ``namespace`` is the rack's, with its slash. Reading values, plots and layouts need no more than this.
    """
    published = _published_topics(rack)
    return Enclave(f"{namespace}/recorder", (Profile(namespace, "recorder", subscribe=published),))


def operator_of(namespace: str, rack: Iterable[Enclave]) -> Enclave:
    """Return the enclave of operators, who subscribe to the rack, publish to ``/set`` topics, call its services."""
    enclaves = tuple(rack)
    inputs = sorted(
        name
        for enclave in enclaves
        for name in enclave.names("subscribe")
        if name.startswith(f"{namespace}/") and name not in _published_topics(enclaves)
    )
    served = sorted({name for enclave in enclaves for name in enclave.names("reply")})
    profile = Profile(
        namespace, "operator_desk", publish=tuple(inputs), subscribe=_published_topics(enclaves), request=tuple(served)
    )
    return Enclave(f"{namespace}/operator_desk", (profile,))


def _published_topics(rack: Iterable[Enclave]) -> tuple[str, ...]:
    return tuple(sorted({name for enclave in rack for name in enclave.names("publish")} - {EVENTS}))


_ANY_RUN = 1
_Names = Callable[[str, str], list[tuple[str, list[str]]]]


def enclave_of_rack(config: RackConfig, arguments: RosArguments = NO_ARGUMENTS) -> Enclave:
    """Return the enclave of a rack that runs in one process.

    Raises:
        RackError: a task has errors.
        RosUnavailable: ROS cannot be initialised.
    """
    return Enclave(f"/{config.namespace}/rack", _profiles(Rack(config), arguments))


def enclaves_of_processes(
    config: RackConfig, processes: Sequence[RackProcess], arguments: RosArguments = NO_ARGUMENTS
) -> tuple[Enclave, ...]:
    """Return the enclaves of the processes of a distributed rack.

    Raises:
        RackError, RosUnavailable: as above.
    """
    process_layout = ProcessLayout([process.slots for process in processes], _ANY_RUN)
    return tuple(
        Enclave(
            f"/{config.namespace}/{process.name}",
            _profiles(Rack(config, local=process.slots), arguments, process_layout),
        )
        for process in processes
    )


def _profiles(rack: Rack, arguments: RosArguments, process_layout: ProcessLayout | None = None) -> tuple[Profile, ...]:
    context = joined_context(arguments)
    try:
        with RackNodes(rack, context=context, arguments=arguments, process_layout=process_layout) as made:
            managers = [] if made.manager is None else [made.manager]
            return tuple(_profile(node) for node in (*managers, *made.nodes))
    finally:
        context.try_shutdown()


def _profile(node: object) -> Profile:
    name, space = node.get_name(), node.get_namespace()  # type: ignore[attr-defined]

    def of(ask: str) -> tuple[str, ...]:
        names: _Names = getattr(node, ask)
        return tuple(sorted(found for found, _ in names(name, space)))

    return Profile(
        space,
        name,
        publish=tuple(sorted({*of("get_publisher_names_and_types_by_node"), LOG})),
        subscribe=of("get_subscriber_names_and_types_by_node"),
        reply=of("get_service_names_and_types_by_node"),
        request=of("get_client_names_and_types_by_node"),
    )
