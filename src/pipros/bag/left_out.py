"""What a command leaves out: topics, messages and files that cannot be read or written, with the reasons."""

from __future__ import annotations

from collections.abc import Callable

from pipros.basics.printable import listed


class LeftOut:
    """Reports each name once, when it is left out.

    Args:
        warn: called with one line for each topic or file, and for the first message of each topic.
    """

    def __init__(self, warn: Callable[[str], object]) -> None:
        self._warn = warn
        self._names: set[tuple[str, bool]] = set()
        self._lacks_anything = False

    def __bool__(self) -> bool:
        """Whether anything that was requested is left out."""
        return self._lacks_anything

    def whole(self, name: str, reason: object, *, is_requested: bool = True) -> None:
        """Report a topic or file that is left out."""
        self._lacks_anything |= is_requested
        self._add(name, is_whole=True, text=f"{listed(name)} is left out: {listed(str(reason))}")

    def message(self, topic: str, reason: object) -> None:
        """Report a message that is left out."""
        self._lacks_anything = True
        text = f"messages on {listed(topic)} are left out: {listed(str(reason))}"
        self._add(topic, is_whole=False, text=text)

    def _add(self, name: str, *, is_whole: bool, text: str) -> None:
        if (name, is_whole) not in self._names:
            self._names.add((name, is_whole))
            self._warn(text)
