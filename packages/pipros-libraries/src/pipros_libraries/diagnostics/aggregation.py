"""The aggregator's output: all statuses by path, and their overall level."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipros_libraries.diagnostics.analyzers import AnalyzerGroup, BadAnalyzer, OtherAnalyzer
from pipros_libraries.diagnostics.items import ERROR, OK, STALE, ComponentStatus

OWNER_LIMIT = 100
"""Maximum number of nodes with added analyzers. Each of these nodes requires a bond."""


class Aggregation:
    """The analyzers of one aggregator, including analyzers added by other nodes. Not thread-safe."""

    def __init__(self, base: str, analyzers: Mapping[str, Any], *, other_as_errors: bool = False) -> None:
        """Create the analyzers.

        Args:
            base: the parent path of all analyzers.
            analyzers: the value of the parameter `analyzers`.
            other_as_errors: whether to report statuses without an analyzer as errors.
        """
        self.base = f"/{base.strip('/')}" if base.strip("/") else ""
        self._configured = AnalyzerGroup(self.base.rpartition("/")[2], self.base, analyzers)
        self._added: dict[str, AnalyzerGroup] = {}
        self._other = OtherAnalyzer(self.base, other_as_errors)

    def problems(self) -> dict[str, str]:
        """Return the errors of the configured analyzers that could not be created, by path."""
        return _problems(self._configured)

    def add(self, owner: str, analyzers: Mapping[str, Any]) -> None:
        """Add another node's analyzers.

        Raises:
            BadAnalyzer: there are no analyzers, one of them is invalid, the node has already added analyzers,
                or too many nodes have added analyzers. In all these cases, no analyzers are added.
        """
        if owner in self._added:
            raise BadAnalyzer(f"{owner} has already added analyzers")
        if len(self._added) >= OWNER_LIMIT:
            raise BadAnalyzer(f"the number of nodes that add analyzers must be <= {OWNER_LIMIT}")
        group = AnalyzerGroup("", self.base, analyzers)
        problems = _problems(group)
        if problems:
            raise BadAnalyzer("; ".join(f"{path}: {reason}" for path, reason in problems.items()))
        if not analyzers:
            raise BadAnalyzer(f"{owner} must set its private parameter 'analyzers'")
        self._added[owner] = group

    def remove(self, owner: str) -> None:
        """Remove the analyzers that a node has added, if any."""
        self._added.pop(owner, None)

    def take(self, status: ComponentStatus, now_s: float) -> None:
        """Process a received status."""
        taken = [group.analyze(status, now_s) for group in (self._configured, *self._added.values())]
        if not any(taken):
            self._other.analyze(status, now_s)

    def report(self, now_s: float) -> list[ComponentStatus]:
        """Return the statuses to publish. Their names are paths."""
        reported = self._configured.report(now_s)
        for group in self._added.values():
            of_group = group.report(now_s)
            reported += of_group[1:] if self.base else of_group
        return [*reported, *self._other.report(now_s)]


def whole_level(reported: list[ComponentStatus]) -> int:
    """Return the highest level. Stale statuses count as errors unless all statuses are stale.

    >>> fine, stale = ComponentStatus("/a", OK), ComponentStatus("/b", STALE)
    >>> whole_level([fine, stale]), whole_level([stale]), whole_level([])
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
