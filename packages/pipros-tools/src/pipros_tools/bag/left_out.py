"""What a command leaves out: topics, messages and files that cannot be read or written, with the reasons."""

from __future__ import annotations

from collections.abc import Callable

from pipros.basics.printable import listed


class LeftOut:
    """Reports each name of each bag once, when it is left out.

    The line of a name names the bag if another bag already lacks the same name.

    Args:
        warn: called with one line for each topic or file, and for the first message of each topic.
    """

    def __init__(self, warn: Callable[[str], object]) -> None:
        self._warn = warn
        self._bags: dict[tuple[str, bool], set[str]] = {}
        self._lacks_anything = False

    def __bool__(self) -> bool:
        """Whether anything that was requested is left out."""
        return self._lacks_anything

    def whole(self, name: str, reason: object, *, bag: str = "", is_requested: bool = True) -> None:
        """Report a topic or file that is left out."""
        self._lacks_anything |= is_requested
        self._add(name, bag, reason, is_whole=True)

    def message(self, topic: str, reason: object, *, bag: str = "") -> None:
        """Report a message that is left out."""
        self._lacks_anything = True
        self._add(topic, bag, reason, is_whole=False)

    def _add(self, name: str, bag: str, reason: object, *, is_whole: bool) -> None:
        bags = self._bags.setdefault((name, is_whole), set())
        if not bags or (bag and "" not in bags and bag not in bags):
            shown = f"{listed(name)} of {listed(bag)}" if bags else listed(name)
            bags.add(bag)
            what = f"{shown} is" if is_whole else f"messages on {shown} are"
            self._warn(f"{what} left out: {listed(str(reason))}")
