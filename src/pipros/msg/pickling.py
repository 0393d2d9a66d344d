"""Pickling of messages whose class was made at run time, and so is in no module.

A pickle carries the full text, and whoever reads it makes the class from that: another process need
not know the type. In the same process it is the very class.
"""

from __future__ import annotations

import copy
from typing import Any
from weakref import WeakValueDictionary

from pipros.msg.base import Message

_alive: WeakValueDictionary[tuple[str, str], type[Message]] = WeakValueDictionary()
"""The classes by type name and full text; it keeps none of them alive."""


def make_picklable(cls: type[Message]) -> type[Message]:
    """Gives the class what `pickle` and `copy` need."""
    _alive[cls._type, cls._full_text] = cls
    added: Any = cls
    added.__reduce_ex__ = _reduce
    added.__copy__ = _copy
    added.__deepcopy__ = _deepcopy
    return cls


def _reduce(message: Message, _protocol: int) -> tuple[Any, ...]:
    return _restore, (message._type, message._full_text), message.__getstate__()


def _restore(type_name: str, full_text: str) -> Message:
    cls = _alive.get((type_name, full_text))
    if cls is None:
        from pipros.msg.dynamic import message_classes_from_text

        cls = message_classes_from_text(type_name, full_text)[type_name]
    return object.__new__(cls)


def _copy(message: Message) -> Message:
    made = object.__new__(type(message))
    made.__setstate__(message.__getstate__())
    return made


def _deepcopy(message: Message, memo: dict[int, Any]) -> Message:
    made = object.__new__(type(message))
    memo[id(message)] = made
    made.__setstate__(copy.deepcopy(message.__getstate__(), memo))
    return made
