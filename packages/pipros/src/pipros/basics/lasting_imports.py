"""Import modules that last until exit, without the price of searching them for reference cycles."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import BuiltinFunctionType, FrameType, FunctionType, ModuleType


@contextmanager
def lasting_imports() -> Iterator[None]:
    """Pause the garbage collector, and spare it the objects of the modules that the block imports.

    Each later search would visit them in vain: tens of thousands of objects, also several times at exit. The
    collector cannot tell them from objects that exist already, among which cycles must still be found. It is
    therefore spared nothing if a function imports the modules, as in a notebook, or if a module that does has
    values other than modules, classes and functions.
    """
    is_first = _has_no_values(sys._getframe(2))  # behind this generator and contextlib
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
        if is_first:
            gc.freeze()
    finally:
        if was_enabled:
            gc.enable()


def _has_no_values(frame: FrameType | None) -> bool:
    """Return whether a frame and its callers are modules that only import and define."""
    while frame is not None:
        is_import = frame.f_code.co_filename.startswith("<frozen ")  # a part of importlib or runpy
        is_module = frame.f_code.co_name == "<module>"
        if not is_import and not (is_module and all(map(_is_definition, [*frame.f_globals.items()]))):
            return False
        frame = frame.f_back
    return True


def _is_definition(item: tuple[str, object]) -> bool:
    name, value = item
    kinds = ModuleType, type, FunctionType, BuiltinFunctionType
    return name.startswith("__") or isinstance(value, kinds) or not gc.is_tracked(value)
