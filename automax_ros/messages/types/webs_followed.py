"""What becomes of the webs of a rack, by its messages: of a recording, or of a rack elsewhere."""

from __future__ import annotations

from collections.abc import Iterable

from automax_ros.messages.types.messages import RollState, WebState
from automax_ros.rackfile.model.plants import PlantConfig
from automax_ros.rackfile.model.webs import cores_of, news_of


class WebsFollowed:
    """Takes the states of rolls and webs of one rack in their order; ``plants`` are those of its rack file."""

    def __init__(self, plants: Iterable[PlantConfig]) -> None:
        self._cores = cores_of(plants)
        self._rolls: dict[str, RollState] = {}
        self._broken: dict[str, bool] = {}

    def take(self, message: RollState | WebState) -> str:
        """Return what has become of a web since its last state, such as ``web W1 broke``; "" if nothing has."""
        if isinstance(message, RollState):
            self._rolls[message.plant] = message
            return ""
        before = self._broken.get(message.web, message.broken)
        self._broken[message.web] = message.broken
        if message.broken == before:
            return ""
        ends = message.from_plant, message.to_plant
        return news_of(message.web, ends, self._cores, self._rolls, broken=message.broken)
