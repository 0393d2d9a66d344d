"""Types that array fields accept, for use in message package stubs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, TypeAlias, TypeVar

Element = TypeVar("Element")


class SupportsArray(Protocol):
    """A numpy array, or an object that can be converted to one."""

    def __array__(self) -> Any: ...


Array: TypeAlias = Sequence[Element] | SupportsArray
Octets: TypeAlias = bytes | bytearray | memoryview | Sequence[int] | SupportsArray
