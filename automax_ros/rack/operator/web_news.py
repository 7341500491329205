"""Says what becomes of the webs of a running rack: they broke, ran out of their roll, or are threaded again."""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.drive.web.signals import end_signals_of
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.webs import cores_of, news_of


class WebNews:
    """Looks at the webs of a rack at each sample of its plants.

    Each that parts or is threaded is told, by itself or by an operation (decision: as a report tells them). How they
    are at the first sample is not, for nothing has happened to them.
    """

    def __init__(self, rack: Rack, tell: Callable[[int, str], None]) -> None:
        """Look from now on; ``tell`` is called with rack time, ns, and words such as ``web W1 broke``."""
        self._plants, self._webs, self._tell = rack.plants, rack.part.webs, tell
        self._cores = cores_of(rack.part.plants)
        self._broken: dict[str, bool] = {}
        if self._webs:
            rack.sampling.observe(self._look)

    def _look(self, now_ns: int) -> None:
        for web in self._webs:
            broken = self._plants.webs[web.name].broken
            if broken is not self._broken.get(web.name, broken):
                ends = web.start, web.end
                rolls = {name: end_signals_of(self._plants.ends[name]) for name in ends}
                self._tell(now_ns, news_of(web.name, ends, self._cores, rolls, broken=broken))
            self._broken[web.name] = broken
