"""What array fields take, for the stubs of message packages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, TypeAlias, TypeVar

Element = TypeVar("Element")


class SupportsArray(Protocol):
    """A numpy array, or what gives itself as one."""

    def __array__(self) -> Any: ...


Array: TypeAlias = Sequence[Element] | SupportsArray
Octets: TypeAlias = bytes | bytearray | memoryview | Sequence[int] | SupportsArray
