"""The native form of a compiled task: built or found in the cache, loaded, and called like the Python forms.

Translations are cached too, since that of a long task takes some seconds. Their key is the SHA-256 of all that a
translation depends on: the lowered scans with the lines of their statements, their callees, the types of their names,
and every source of this installation. Like a library, a text is read only from a complete file that other users cannot
write (``NativeCache``).
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import sys
import zlib
from collections.abc import Callable, Generator, Sequence
from functools import lru_cache, partial
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from typing import Any

from automax_ros.compile.base.native_source import NOT_KEPT, NativeSource, NotNative, TaskFunction
from automax_ros.compile.base.scan_io import ScanIo, ScanTooLong, StateValues
from automax_ros.compile.blocks.coefficients import CoefficientFunction
from automax_ros.compile.compiler import CompiledTask, Scans
from automax_ros.compile.native.run.build import library, python_options, require_tools
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.run.columns import BesideLatch, Column, Columns, ExecutedScans
from automax_ros.compile.native.run.compiler_process import LIMIT_S
from automax_ros.compile.native.run.slots import StateSlots, kind_of
from automax_ros.compile.native.translate.translation import fixed_parts, scans_of, translated
from automax_ros.parallel.installation import installation

_TRANSLATOR = (installation().sources, sys.implementation.cache_tag, *fixed_parts())
"""The translator's sources: read when this module is loaded, like the other modules, so that they match what runs."""


_HOST = "automax_host"
_HOST_TEXTS = ("abi.h", "host/values.c", "host/touch.c", "host/state.c", "host/scans.c", "host/library.c")
"""The files that make up the host, in their order."""


def kept_translation(compiled: CompiledTask, cache: NativeCache, *, builds: bool = True) -> NativeSource:
    """Return the C of a task's scans, as ``translate`` does: from the cache, or, if ``builds``, translated and cached.

    Raises:
        NotNative: the task has no translation, or none in the cache and not ``builds``, or the cache is not safe.
    """
    form = scans_of(compiled)
    key = translation_key(compiled, form)
    content = cache.read(key)
    if content is not None:
        name, text, limits = json.loads(zlib.decompress(content))
        return NativeSource(name, text, tuple((low, high) for low, high in limits))
    if not builds:
        raise NotNative(NOT_KEPT)
    source = translated(compiled, form)
    cache.keep(key, zlib.compress(json.dumps([source.name, source.text, source.limits]).encode(), 1))
    return source


def translation_key(compiled: CompiledTask, form: TaskFunction) -> str:
    """Return the SHA-256 of all that the translation of a task's scans in a form depends on."""
    program = compiled.program
    symbols = [(item.name, item.type, item.scope, item.dimensions, item.length) for item in program.symbols.values()]
    parts = (
        *_TRANSLATOR,
        program.name,
        ast.dump(form.function, include_attributes=True),
        *(f"{name} {_describe(item)}" for name, item in sorted(form.known.items())),
        sorted(form.views.items()),
        symbols,
        compiled.layout.fields,
        compiled.latched,
        compiled.written,
    )
    return hashlib.sha256("\0".join(map(str, parts)).encode()).hexdigest()


def _describe(item: object) -> str:
    """Return a description of a global of generated code; a function is described by its own name in the sources."""
    if isinstance(item, CoefficientFunction):
        return repr((item.block.name, item.period_s, sorted(item.literals.items()), item.evaluated))
    name = getattr(item, "__qualname__", None)
    return repr(item) if name is None else f"{getattr(item, '__module__', '')}.{name}"


class NativeTask:
    """A task whose scans are machine code; ``scans`` and ``scans_forced`` are called like those of ``CompiledTask``."""

    def __init__(self, compiled: CompiledTask, source: NativeSource, path: Path, host: Any) -> None:
        """Load a task's library with the module that calls it.

        Raises:
            OSError: it cannot be loaded.
        """
        symbols = compiled.program.symbols
        slots = StateSlots(compiled.layout, source.limits)
        kinds = tuple(kind_of(symbols[name].type) for name in compiled.latched)
        places = [compiled.latched.index(name) for name in compiled.written]
        written = tuple((place, compiled.latched_views[place]) for place in places)
        latched = tuple(zip(kinds, compiled.latched_views, strict=True))
        code = host.Code(os.fsencode(path), slots.fields, latched, written, ScanTooLong)
        self.compiled, self.source = compiled, source
        self.scans: Scans = partial(code.scans, compiled.scans)
        self.scans_forced: Scans = partial(code.scans_forced, _forced_in_python(compiled))
        self._columns = Columns(path, slots, kinds, places)

    def columns(
        self,
        state: StateValues,
        latched: Sequence[Column],
        count: int,
        actual: BesideLatch | None = None,
        *,
        latches_own: bool = False,
    ) -> ExecutedScans:
        """Execute ``count`` scans on columns of latched values: int64, float64 for REALs; the state changes in place.

        ``latches_own``: of the outputs each scan latches what the one before has left, only the first one its column.

        Raises:
            ValueError: the columns or the rows of ``actual`` do not fit the task or the count.
        """
        return self._columns.execute(state, latched, count, actual, latches_own=latches_own)


def native_form(
    compiled: CompiledTask,
    cache: NativeCache,
    translator: Callable[[CompiledTask], NativeSource] | None = None,
    limit_s: float = LIMIT_S,
    *,
    builds: bool = True,
) -> NativeTask:
    """Return the native form of a task, from the cache or, if ``builds``, built now. Any thread may call this.

    Raises:
        NotNative: the task cannot be native, or not on this machine, with the reason.
    """
    try:
        require_tools(limit_s)  # first, since translating a long task takes some seconds
        source = kept_translation(compiled, cache, builds=builds) if translator is None else translator(compiled)
        path = library(source.text, cache, limit_s=limit_s, builds=builds)
        return NativeTask(compiled, source, path, host_module(cache, limit_s, builds=builds))
    except (OSError, ImportError) as error:
        raise NotNative(f"native code cannot be loaded: {error}; is the cache's folder mounted noexec?") from error


def _forced_in_python(compiled: CompiledTask) -> Scans:
    def scans(state: StateValues, io: ScanIo) -> Generator[bool, None, None]:
        return compiled.scans_forced(state, io)

    return scans


def host_module(cache: NativeCache, limit_s: float = LIMIT_S, *, builds: bool = True) -> Any:
    """Return the module that calls native tasks, from the cache or built now.

    Raises:
        NotNative: it cannot be built here, or not ``builds``.
        OSError, ImportError: it cannot be loaded.
    """
    folder = Path(__file__).parent.parent
    text = "\n".join((folder / name).read_text(encoding="utf-8") for name in _HOST_TEXTS)
    return _host(str(library(text, cache, python_options(), limit_s, builds=builds)))


@lru_cache(maxsize=4)
def _host(path: str) -> Any:
    """Return the module that calls native tasks; it is not put into ``sys.modules``."""
    loader = ExtensionFileLoader(_HOST, path)
    spec = spec_from_loader(_HOST, loader)
    assert spec is not None
    known = sys.modules.get(_HOST)
    module = module_from_spec(spec)
    loader.exec_module(module)
    if known is None:
        sys.modules.pop(_HOST, None)
    return module
