"""Constants of pipros that a test changes, such as limits on what a peer can consume."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType

Constants = Callable[..., None]
"""The fixture `constants`: `constants(HANDSHAKES=8)` applies until the test ends."""


@contextmanager
def changed(**values: object) -> Iterator[None]:
    """Give constants other values in the module that defines them, and in those that import them.

    Code in other processes, and objects that read the constant before, keep the value.
    """
    before = {name: _value(name) for name in values}
    for name, value in values.items():
        _set(name, before[name], value)
    try:
        yield
    finally:
        for name, value in values.items():
            _set(name, value, before[name])  # also in modules that were imported since


def _holders(name: str) -> list[ModuleType]:
    return [module for module in list(sys.modules.values()) if name in getattr(module, "__dict__", ())]


def _value(name: str) -> object:
    found = [vars(module)[name] for module in _holders(name) if module.__name__.startswith("pipros")]
    assert found, f"no imported module of pipros has the constant {name}"
    assert found.count(found[0]) == len(found), f"{name} has several values: {found}"
    return found[0]


def _set(name: str, old: object, new: object) -> None:
    for module in _holders(name):
        if vars(module)[name] == old:
            setattr(module, name, new)
