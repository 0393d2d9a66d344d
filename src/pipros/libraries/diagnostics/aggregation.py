"""What the aggregator publishes: all statuses by path, and their overall level."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipros.libraries.diagnostics.analyzers import AnalyzerGroup, BadAnalyzer, OtherAnalyzer
from pipros.libraries.diagnostics.items import ERROR, OK, STALE, Status

OWNER_LIMIT = 100
"""Nodes that may have added analyzers at a time; each costs a bond."""


class Aggregation:
    """The analyzers of one aggregator, and those that other nodes have added. Not thread-safe."""

    def __init__(self, base: str, analyzers: Mapping[str, Any], *, other_as_errors: bool = False) -> None:
        """No status has arrived yet.

        Args:
            base: the path of all analyzers.
            analyzers: the parameters of that name.
            other_as_errors: whether statuses without an analyzer are errors.
        """
        self.base = f"/{base.strip('/')}" if base.strip("/") else ""
        self._own = AnalyzerGroup(self.base.rpartition("/")[2], self.base, analyzers)
        self._added: dict[str, AnalyzerGroup] = {}
        self._other = OtherAnalyzer(self.base, other_as_errors)

    def problems(self) -> dict[str, str]:
        """The errors of analyzers in the parameters, by path."""
        return _problems(self._own)

    def add(self, owner: str, analyzers: Mapping[str, Any]) -> None:
        """Adds analyzers of another node.

        Raises:
            BadAnalyzer: one of them cannot be used, or the node has added some already. Nothing was added.
        """
        if owner in self._added:
            raise BadAnalyzer("", f"{owner} has added analyzers already")
        if len(self._added) >= OWNER_LIMIT:
            raise BadAnalyzer("", f"{OWNER_LIMIT} nodes have added analyzers already")
        group = AnalyzerGroup("", self.base, analyzers)
        problems = _problems(group)
        if problems:
            raise BadAnalyzer("", "; ".join(f"{path}: {reason}" for path, reason in problems.items()))
        if not analyzers:
            raise BadAnalyzer("", f"{owner} has no parameters 'analyzers'")
        self._added[owner] = group

    def remove(self, owner: str) -> None:
        """Removes the analyzers of another node, if it has added any."""
        self._added.pop(owner, None)

    def take(self, status: Status, now_s: float) -> None:
        """Adds a status."""
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
    """The overall level: the highest; stale counts as an error unless everything is stale.

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
