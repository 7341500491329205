"""Translations of tasks, kept in the cache: a long task's takes some seconds.

What is kept is found by the SHA-256 of all that a translation depends on: the lowered scans with the lines of their
statements, what they call, the types of what they name, and every source of this installation. A text comes back only
from a file that nobody else can write, and that is whole (``NativeCache``), as a library does.
"""

from __future__ import annotations

import ast
import hashlib
import json
import sys
import zlib

from automax_ros.compile.assembly import Form
from automax_ros.compile.coefficient_function import CoefficientFunction
from automax_ros.compile.compiler import CompiledTask
from automax_ros.compile.native.cache import NativeCache
from automax_ros.compile.native.source import NOT_KEPT, NativeSource, NotNative
from automax_ros.compile.native.translation import fixed_parts, scans_of, translated
from automax_ros.pieces.installation import installation

_TRANSLATOR = (installation().sources, sys.implementation.cache_tag, *fixed_parts())
"""What translates: looked at when this module is loaded, as are the others, so that it is what runs."""


def kept_translation(compiled: CompiledTask, cache: NativeCache, *, builds: bool = True) -> NativeSource:
    """Return the C of a task's scans, as ``translate`` does: from the cache, or translated if it ``builds``, and kept.

    Raises:
        NotNative: the task has no translation, or only a new one, or the cache is not safe.
    """
    form = scans_of(compiled)
    key = translation_key(compiled, form)
    content = cache.read(key)
    if content is not None:
        return _unpacked(content)
    if not builds:
        raise NotNative(NOT_KEPT)
    source = translated(compiled, form)
    cache.keep(key, _packed(source))
    return source


def translation_key(compiled: CompiledTask, form: Form) -> str:
    """Return the SHA-256 of all that the translation of a task's scans in a form depends on."""
    program = compiled.program
    symbols = [(item.name, item.type, item.scope, item.dimensions, item.length) for item in program.symbols.values()]
    parts = (
        *_TRANSLATOR,
        program.name,
        ast.dump(form.function, include_attributes=True),
        *(f"{name} {_described(item)}" for name, item in sorted(form.known.items())),
        sorted(form.views.items()),
        symbols,
        compiled.layout.fields,
        compiled.latched,
        compiled.written,
    )
    return hashlib.sha256("\0".join(map(str, parts)).encode()).hexdigest()


def _described(item: object) -> str:
    """Return what generated code knows by a name: a function is one of the sources, by its own name."""
    if isinstance(item, CoefficientFunction):
        return repr((item.block.name, item.period_s, sorted(item.literals.items()), item.evaluated))
    name = getattr(item, "__qualname__", None)
    return repr(item) if name is None else f"{getattr(item, '__module__', '')}.{name}"


def _packed(source: NativeSource) -> bytes:
    return zlib.compress(json.dumps([source.name, source.text, source.limits]).encode(), 1)


def _unpacked(content: bytes) -> NativeSource:
    name, text, limits = json.loads(zlib.decompress(content))
    return NativeSource(name, text, tuple((low, high) for low, high in limits))
