"""A lifecycle manager of a test's own: it asks for transitions and states over DDS."""

from typing import Any

UNCONFIGURED, INACTIVE, ACTIVE, FINALIZED = "unconfigured", "inactive", "active", "finalized"


class Manager:
    """Asks the nodes of one rack; ``until`` lets rack and client live until a condition is true."""

    def __init__(self, client: Any, space: str, until: Any) -> None:
        from lifecycle_msgs.msg import Transition
        from lifecycle_msgs.srv import ChangeState, GetState

        self._client, self._space, self._until = client, space, until
        self._change, self._get, self._transition = ChangeState, GetState, Transition

    def ask(self, node: str, transition: str | int) -> bool:
        """Ask for a transition, by its label or its number; return whether it succeeded."""
        wanted = {"id": transition} if isinstance(transition, int) else {"label": transition}
        request = self._change.Request(transition=self._transition(**wanted))
        return bool(self._call(self._change, f"{node}/change_state", request).success)

    def state(self, node: str) -> str:
        return str(self._call(self._get, f"{node}/get_state", self._get.Request()).current_state.label)

    def _call(self, kind: Any, service: str, request: Any) -> Any:
        asking = self._client.node.create_client(kind, f"{self._space}/{service}")
        self._until(asking.service_is_ready)
        future = asking.call_async(request)
        self._until(future.done)
        self._client.node.destroy_client(asking)
        return future.result()
