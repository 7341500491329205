"""The verbs on the plants and webs of a rack, a table for each: stimuli, services, commands and help use these.

Those of ``drive/plant/faults`` are on a plant alone; here come those on its roll or roller, and on webs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.plant.faults import VERBS, Numbers, execute_verb, in_ranges, one_of, values_of
from automax_ros.drive.web.data import Roll, Roller
from automax_ros.drive.web.end import WebEnd
from automax_ros.drive.web.verbs import break_web, require_slip, roll_for, set_stiffness, slip, splice, thread_web
from automax_ros.rack.plants import RackPlants


@dataclass(frozen=True)
class WorkVerb:
    """The values and the action of a verb.

    Attributes:
        wants: a description of its values, for messages.
        read: converts a text to numbers; ValueError where the text is not valid for the verb.
        act: executes the verb on the plant or web of that name, at its present.
        keys: names of the numbers, for a form with keys.
        needed: how many of them must be given, from the first on.
        usual: defaults of the others; those at the end without a default may be left out.
        of: the kind of surface that it is for, Roll or Roller; None for any plant or web.
        check: raises ParameterError where the plant or web of that name can never do so; None where all of them can.
    """

    wants: str
    read: Callable[[str], Numbers]
    act: Callable[[RackPlants, str, Numbers], None]
    keys: tuple[str, ...] = field(default=())
    needed: int = 1
    usual: Numbers = field(default=())
    of: type[Roll | Roller] | None = None
    check: Callable[[RackPlants, str, Numbers], object] | None = None

    @property
    def is_alone(self) -> bool:
        """Whether it takes no value: its name says all."""
        return not self.wants


def _of_plant(verb: str, plants: RackPlants, name: str, values: Numbers) -> None:
    execute_verb(plants[name], verb, values)


def _end(plants: RackPlants, name: str) -> WebEnd:
    if name not in plants.ends:
        raise ParameterError(f"plant {name} has neither roll nor roller")
    return plants.ends[name]


def _splice(plants: RackPlants, name: str, values: Numbers) -> None:
    splice(_end(plants, name), values[0])


def _check_splice(plants: RackPlants, name: str, values: Numbers) -> None:
    roll_for(_end(plants, name), values[0])


def _check_slip(plants: RackPlants, name: str, values: Numbers) -> None:
    require_slip(_end(plants, name), values[0])


def _slip(plants: RackPlants, name: str, values: Numbers) -> None:
    slip(_end(plants, name), values[0])


def _break(plants: RackPlants, name: str, _: Numbers) -> None:
    break_web(plants.webs[name])


def _thread(plants: RackPlants, name: str, _: Numbers) -> None:
    thread_web(plants.webs[name], f"web {name}")


def _stiffness(plants: RackPlants, name: str, values: Numbers) -> None:
    set_stiffness(plants.webs[name], values[0])


PLANT_VERBS: Mapping[str, WorkVerb] = {
    **{
        name: WorkVerb(verb.wants, verb.read, partial(_of_plant, name), verb.keys, verb.needed, verb.usual)
        for name, verb in VERBS.items()
    },
    "splice": WorkVerb(
        "the diameter of a new roll, m, 0.01 to 10", in_ranges((0.01, 10.0)), _splice, of=Roll, check=_check_splice
    ),
    "slip": WorkVerb(
        "the part of the arriving tension that the roller carries, 0 to 1",
        in_ranges((0.0, 1.0)),
        _slip,
        of=Roller,
        check=_check_slip,
    ),
}
"""All verbs on a plant, its roll or roller, by name."""
_ALONE = one_of({"": 1, "TRUE": 1})
WEB_VERBS: Mapping[str, WorkVerb] = {
    "break": WorkVerb("", _ALONE, _break),
    "thread": WorkVerb("", _ALONE, _thread),
    "stiffness_n": WorkVerb("N, 100 to 1e9", in_ranges((1e2, 1e9)), _stiffness),
}
"""All verbs on a web, by name."""


VERBS_OF: Mapping[str, Mapping[str, WorkVerb]] = {"plant": PLANT_VERBS, "web": WEB_VERBS}
"""The verbs by what they are on."""


def named_in(plants: RackPlants, what: str) -> Mapping[str, object]:
    """Return what the verbs on a ``plant`` or a ``web`` can be on, by name."""
    return plants.webs if what == "web" else plants


def read_values(what: str, verb: str, text: str) -> Numbers:
    """Return the numbers that a verb on a ``plant`` or a ``web`` reads from a text.

    Raises:
        ParameterError: there is no such verb, or the text is not valid for it.
    """
    return values_of(verb, text, VERBS_OF[what], f"a {what}")
