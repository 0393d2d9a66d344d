"""Call a function when a module has been imported."""

from __future__ import annotations

import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType
    from typing import Any


def after_import(name: str, call: Callable[[ModuleType], object]) -> None:
    """Call a function with a module, now if it is imported already, otherwise after its first import.

    The function is called once, even if it was passed several times before the import.

    Args:
        name: the module's name, without a package.
        call: the function.
    """
    module = sys.modules.get(name)
    if module is not None:
        call(module)
    elif not any(isinstance(each, _Finder) and each.calls(name, call) for each in sys.meta_path):
        sys.meta_path.insert(0, _Finder(name, call))


class _Finder:
    """Import hook for the first import of a module."""

    def __init__(self, name: str, call: Callable[[ModuleType], object]) -> None:
        self._name = name
        self._call = call

    def calls(self, name: str, call: Callable[[ModuleType], object]) -> bool:
        return (name, call) == (self._name, self._call)

    def find_spec(
        self, name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != self._name:
            return None
        sys.meta_path.remove(self)
        from importlib.util import find_spec

        spec = find_spec(name)
        loader: Any = spec and spec.loader
        if loader is not None:
            execute = loader.exec_module

            def execute_and_call(module: ModuleType) -> None:
                execute(module)
                self._call(module)

            loader.exec_module = execute_and_call
        return spec
