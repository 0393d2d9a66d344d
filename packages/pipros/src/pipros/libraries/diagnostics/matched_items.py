"""The statuses that an analyzer accepts, as items with a summary."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from pipros.libraries.diagnostics.items import ERROR, OK, STALE, ComponentStatus, Item, level_name
from pipros.libraries.diagnostics.name_patterns import NamePatterns

TIMEOUT_S = 5.0
"""Time without an update after which an item is stale, unless `timeout` is set."""
ITEM_LIMIT = 10_000
"""Maximum number of items in one analyzer. Limited because any peer can choose item names."""


@dataclass(frozen=True, slots=True)
class Criteria:
    """Criteria for the names that an analyzer accepts. A name must satisfy at least one of them."""

    names: frozenset[str] = frozenset()
    starts: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()
    patterns: NamePatterns = field(default_factory=lambda: NamePatterns(()))

    def __bool__(self) -> bool:
        return bool(self.names or self.starts or self.parts or self.patterns)

    def match(self, name: str) -> bool:
        return (
            name in self.names
            or name.startswith(self.starts)
            or any(part in name for part in self.parts)
            or self.patterns.match(name)
        )


class Items:
    """The items of one analyzer, and the status that summarizes them."""

    def __init__(
        self,
        name: str,
        path: str,
        *,
        expected: Sequence[str] = (),
        prefixes: Sequence[str] = (),
        timeout_s: float = TIMEOUT_S,
        count: int = -1,
        discards_stale: bool = False,
    ) -> None:
        """Create the list of items, which initially contains only the expected items.

        Args:
            expected: the names of items that are reported as missing until they arrive.
            prefixes: prefixes to remove from the names of reported items.
            timeout_s: time without an update after which an item is stale; 0 for never.
            count: the required number of items; -1 for any.
            discards_stale: whether to remove stale items instead of reporting them.
        """
        self.name, self.path = name, path
        self._prefixes = tuple(prefixes)
        self._timeout_s, self._count, self._discards_stale = timeout_s, count, discards_stale
        self._items = {item: Item(ComponentStatus(item)) for item in expected}

    def analyze(self, status: ComponentStatus, now_s: float) -> bool:
        if status.name not in self._items and len(self._items) >= ITEM_LIMIT:
            return False
        self._items[status.name] = Item(status, now_s)
        return True

    def report(self, now_s: float) -> list[ComponentStatus]:
        """Return the summary and the items.

        The summary has the highest level of the items, but is an error if only some of them are stale, or if
        their number differs from a positive `count`. It is stale if there are no items, unless `count` is 0.
        """
        reported, values, levels = [], [], []
        for name, item in list(self._items.items()):
            is_stale = self._is_stale(item, now_s)
            if is_stale and self._discards_stale:
                del self._items[name]
                continue
            status = item.below(self.path, self._prefixes, is_stale)
            reported.append(status)
            values.append((name, status.message))
            levels.append(status.level)
        level = summed_up(levels) if levels or self._count == 0 else STALE
        message = level_name(level)
        if self._count > 0 and len(reported) != self._count:
            level = max(level, ERROR)
            message = f"Expected {self._count}, found {len(reported)}"
        return [ComponentStatus(self.path, level, message, values=tuple(values)), *reported]

    def _is_stale(self, item: Item, now_s: float) -> bool:
        if item.updated_s is None:
            return True
        return self._timeout_s > 0 and not 0 <= now_s - item.updated_s <= self._timeout_s


def summed_up(levels: Sequence[int]) -> int:
    """Return the highest level, or OK if `levels` is empty. STALE counts as ERROR unless all are STALE.

    >>> summed_up([0, 1]), summed_up([3, 0]), summed_up([3, 3]), summed_up([])
    (1, 2, 3, 0)
    """
    highest = max(levels, default=OK)
    return ERROR if highest == STALE and min(levels) != STALE else highest
