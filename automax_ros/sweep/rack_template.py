"""A rack as text, from which any process on any machine builds the same racks; tasks are compiled once per process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from automax_ros.compile.native.run.forms import IN_PYTHON, NativeForms
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.problems import Severity
from automax_ros.core.user_error import UserError
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import Installation
from automax_ros.rackfile.loader import load_stored
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.plant_numbers import PlantNumber, with_numbers


@dataclass(frozen=True)
class RackTemplate:
    """A rack file's text and path, and the sources of the tasks by name: no file is read again.

    ``native`` selects which tasks scan as machine code, which changes no result.
    """

    text: str
    path: str
    sources: tuple[tuple[str, SourceText], ...]
    native: NativeForms = IN_PYTHON

    @classmethod
    def of(cls, rack: Rack, native: NativeForms = IN_PYTHON) -> RackTemplate:
        """Return the template of a rack as it is installed."""
        return cls(rack.config.text, str(rack.config.path), tuple(rack.sources.items()), native)

    def prepare(self) -> None:
        """Compile the tasks, so that copies of this process need not."""
        _installation(self)

    def rack(self, plants: Mapping[PlantNumber, str]) -> Rack:
        """Return a new rack with some other numbers of its plants.

        Raises:
            UserError: with these numbers the rack file has errors.
        """
        config = _config(self.text, self.path, tuple(plants.items()))
        return Rack(config, installation=_installation(self).again(config))


@lru_cache(maxsize=1)
def _config(text: str, path: str, numbers: tuple[tuple[PlantNumber, str], ...] = ()) -> RackConfig:
    result = load_stored(SourceText(path, with_numbers(text, dict(numbers))), Path(path))
    if result.config is None:
        first = next(item for item in result.diagnostics if item.severity is Severity.ERROR)
        raise UserError(first.message, first.hint, code=first.code)
    return result.config


@lru_cache(maxsize=1)
def _installation(blueprint: RackTemplate) -> Installation:
    config = _config(blueprint.text, blueprint.path)
    return Installation(config, sources=dict(blueprint.sources), native=blueprint.native)
