"""Import modules that last until exit, without the price of searching them for reference cycles."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import BuiltinFunctionType, FunctionType, ModuleType


@contextmanager
def lasting_imports() -> Iterator[None]:
    """Pause the garbage collector, and spare it the objects of the modules that the block imports.

    Each later search would visit them in vain: tens of thousands of objects, also several times at exit. The
    collector cannot tell them from objects that exist already, so it is spared nothing if the main module
    has values other than modules, classes and functions, as in a notebook: a cycle among these must still
    be found.
    """
    has_no_values = all(map(_is_definition, vars(sys.modules["__main__"]).items()))
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
        if has_no_values:
            gc.freeze()
    finally:
        if was_enabled:
            gc.enable()


def _is_definition(item: tuple[str, object]) -> bool:
    name, value = item
    kinds = ModuleType, type, FunctionType, BuiltinFunctionType
    return name.startswith("__") or isinstance(value, kinds) or not gc.is_tracked(value)
