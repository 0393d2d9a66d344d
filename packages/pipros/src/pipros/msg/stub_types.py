"""Types that array fields accept, for use in message package stubs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, TypeAlias, TypeVar

from pipros.msg.time import Duration, Time

Element = TypeVar("Element")


class SupportsArray(Protocol):
    """A numpy array, or an object that can be converted to one."""

    def __array__(self) -> Any: ...


class Indexable(Protocol):
    """A tuple, list or numpy array of numbers."""

    def __getitem__(self, index: int, /) -> Any: ...


Array: TypeAlias = Sequence[Element] | SupportsArray
Octets: TypeAlias = bytes | bytearray | memoryview | Sequence[int] | SupportsArray
FieldValue: TypeAlias = float | Sequence[Any] | SupportsArray | Time | Duration
"""The value of a message's only field, given instead of the message. Excludes messages, so that type checkers
report a message of the wrong type.
"""
