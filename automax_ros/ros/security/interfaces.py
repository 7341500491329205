"""What the nodes of a rack open in the graph, read from the nodes themselves.

They are made as `automax run` makes them, in a context that reaches nobody, asked, and destroyed: no task scans. So a
policy has what the program does, and not what somebody wrote down of it (decision).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.processes import RackProcess
from automax_ros.ros.distributed.bus import ProcessLayout
from automax_ros.ros.rack_nodes import RackNodes
from automax_ros.ros.security.profiles import LOG, Enclave, Profile
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments
from automax_ros.ros.setup.process import joined_context

_ANY_RUN = 1
_Names = Callable[[str, str], list[tuple[str, list[str]]]]


def enclave_of_rack(config: RackConfig, arguments: RosArguments = NO_ARGUMENTS) -> Enclave:
    """Return the enclave of a rack that runs in one process.

    Raises:
        RackError: a task has errors.
        RosUnavailable: ROS cannot be initialised.
    """
    return Enclave(f"/{config.namespace}/rack", _profiles(Rack(config), arguments))


def enclaves_of_seats(
    config: RackConfig, seats: Sequence[RackProcess], arguments: RosArguments = NO_ARGUMENTS
) -> tuple[Enclave, ...]:
    """Return the enclaves of the processes of a distributed rack.

    Raises:
        RackError, RosUnavailable: as above.
    """
    seating = ProcessLayout([seat.slots for seat in seats], _ANY_RUN)
    return tuple(
        Enclave(f"/{config.namespace}/{seat.name}", _profiles(Rack(config, local=seat.slots), arguments, seating))
        for seat in seats
    )


def _profiles(rack: Rack, arguments: RosArguments, seating: ProcessLayout | None = None) -> tuple[Profile, ...]:
    context = joined_context(arguments)
    try:
        with RackNodes(rack, context=context, arguments=arguments, seating=seating) as made:
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
