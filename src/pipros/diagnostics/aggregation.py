"""What the aggregator publishes of the statuses that came: all of them by path, and one level of all."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipros.diagnostics.analyzers import AnalyzerGroup, BadAnalyzer, OtherAnalyzer
from pipros.diagnostics.items import ERROR, OK, STALE, Status


class Aggregation:
    """The analyzers of one aggregator, and those that other nodes have added.

    Not for use by several threads at a time.
    """

    def __init__(self, base: str, analyzers: Mapping[str, Any], *, other_as_errors: bool = False) -> None:
        """Args: `base` is the path of all; `analyzers` are the parameters of that name."""
        self.base = f"/{base.strip('/')}" if base.strip("/") else ""
        self._own = AnalyzerGroup(self.base.rpartition("/")[2], self.base, analyzers)
        self._added: dict[str, AnalyzerGroup] = {}
        self._other = OtherAnalyzer(self.base, other_as_errors)

    def problems(self) -> dict[str, str]:
        """What is wrong with analyzers of the parameters, by their paths."""
        return _problems(self._own)

    def add(self, owner: str, analyzers: Mapping[str, Any]) -> None:
        """Adds analyzers of another node.

        Raises:
            BadAnalyzer: one of them cannot be used, or the node has added some already. Nothing was added.
        """
        if owner in self._added:
            raise BadAnalyzer("", f"{owner} has added analyzers already")
        group = AnalyzerGroup("", self.base, analyzers)
        problems = _problems(group)
        if problems:
            raise BadAnalyzer("", "; ".join(f"{path}: {reason}" for path, reason in problems.items()))
        if not analyzers:
            raise BadAnalyzer("", f"{owner} has no parameters 'analyzers'")
        self._added[owner] = group

    def remove(self, owner: str) -> None:
        """Takes the analyzers of another node away, if it has added any."""
        self._added.pop(owner, None)

    def take(self, status: Status, now_s: float) -> None:
        """Takes a status over."""
        taken = [group.analyze(status, now_s) for group in (self._own, *self._added.values())]
        if not any(taken):
            self._other.analyze(status, now_s)

    def report(self, now_s: float) -> list[Status]:
        """All statuses by path."""
        reported = self._own.report(now_s)
        for group in self._added.values():
            of_group = group.report(now_s)
            reported += of_group[1:] if self.base else of_group
        return [*reported, *self._other.report(now_s)]


def whole_level(reported: list[Status]) -> int:
    """The level of everything: the highest; what is stale counts as an error unless all is.

    >>> whole_level([Status("/a", 0), Status("/b", 3)]), whole_level([Status("/b", 3)]), whole_level([])
    (2, 3, 0)
    """
    levels = [status.level for status in reported]
    highest = max(levels, default=OK)
    return ERROR if highest >= STALE and min(levels) <= ERROR else highest


def _problems(group: AnalyzerGroup) -> dict[str, str]:
    found = {f"{group.path}/{key}": str(error) for key, error in group.problems.items()}
    for inner in group.groups:
        found.update(_problems(inner))
    return found
