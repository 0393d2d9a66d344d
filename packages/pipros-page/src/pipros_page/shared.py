"""Values shared by the views of all browsers, so that messages are decoded and stored once."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

T = TypeVar("T")


class Shared(Generic[T]):
    """A value that is created for its first user and closed after its last. For use in one event loop."""

    def __init__(self, make: Callable[[], contextlib.AbstractContextManager[T]]) -> None:
        self._make = make
        self._users = 0
        self._stack = contextlib.ExitStack()
        self._value: T

    @contextlib.contextmanager
    def use(self) -> Iterator[T]:
        """Provide the value, which stays open within the context."""
        if not self._users:
            self._value = self._stack.enter_context(self._make())
        self._users += 1
        try:
            yield self._value
        finally:
            self._users -= 1
            if not self._users:
                self._stack.close()
