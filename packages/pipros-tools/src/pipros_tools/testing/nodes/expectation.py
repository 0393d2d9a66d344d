"""Check that topics and services appear, or do not appear, within a time limit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pipros.node import Node
from pipros.node.clock import Clock
from pipros_tools.testing.nodes.run_checks import parameter, poll

# unittest's reports omit the frames of modules that define this variable.
__unittest = True

DEFAULT_TIMEOUT_S = 10.0
"""The default time limit for a topic or service to appear."""


@dataclass(frozen=True, slots=True)
class Expectation:
    """One entry in a list of topics or services to check.

    Attributes:
        name: the global name.
        timeout_s: the time limit for the topic or service to appear; if `negative`, the time during which it
            must not appear.
        negative: whether the topic or service must not exist.
        type: the required type; None for any type.
    """

    name: str
    timeout_s: float = DEFAULT_TIMEOUT_S
    negative: bool = False
    type: str | None = None

    @classmethod
    def read(cls, entry: Any, resolve: Callable[[str], str]) -> Expectation:
        """Parse `{name: …, timeout: …, negative: …, type: …}`; only the name is required.

        Raises:
            AssertionError: the entry is not a dictionary with a name, or its timeout is not a number.
        """
        if not isinstance(entry, Mapping) or not isinstance(entry.get("name"), str):
            raise AssertionError(
                f"'name' field in rosparam is required but not specified: {entry!r} must be "
                "{name: …, timeout: …, negative: …}"
            )
        timeout = entry.get("timeout", DEFAULT_TIMEOUT_S)
        if isinstance(timeout, bool) or not isinstance(timeout, (int, float)):
            raise AssertionError(f"the timeout of [{entry['name']}] must be a number, got {timeout!r}")
        return cls(
            resolve(entry["name"]), float(timeout), bool(entry.get("negative", False)), entry.get("type")
        )


def expectations(node: Node, name: str) -> list[Expectation]:
    """Return the expectations in a parameter, or an empty list if it is not set.

    Raises:
        AssertionError: the parameter is not a list of expectations.
    """
    entries = parameter(node, name, [])
    if not isinstance(entries, list):
        raise AssertionError(f"parameter [{node.resolve(name)}] must be a list, got {entries!r}")
    return [Expectation.read(entry, node.resolve) for entry in entries]


Find = Callable[[Expectation], str | None]
"""Function that returns the type of the expected topic or service, or None if it does not exist."""


class Watch:
    """Several expectations with a common start time. Callers pass in the elapsed time.

    >>> watch = Watch([Expectation("/level", 2.0)], "topic")
    >>> watch.check(0.5, lambda expected: None)
    False
    >>> watch.check(1.0, lambda expected: "std_msgs/String")
    True
    """

    def __init__(self, expected: list[Expectation], what: str) -> None:
        self._open = expected
        self._what = what

    @property
    def longest_s(self) -> float:
        return max((item.timeout_s for item in self._open), default=0.0)

    def check(self, elapsed_s: float, find: Find) -> bool:
        """Check all undecided expectations; return True if all are decided.

        Raises:
            AssertionError: an expectation was not met.
        """
        self._open = [item for item in self._open if not self._is_decided(item, elapsed_s, find(item))]
        return not self._open

    def _is_decided(self, item: Expectation, elapsed_s: float, found: str | None) -> bool:
        is_over = elapsed_s >= item.timeout_s
        if found is None:
            if is_over and not item.negative:
                raise AssertionError(f"{self._what} [{item.name}] did not appear within {item.timeout_s:g} s")
            return is_over
        if item.negative:
            raise AssertionError(f"{self._what} [{item.name}] exists, but must not exist")
        if item.type not in (None, found):
            raise AssertionError(
                f"{self._what} [{item.name}] must have the type [{item.type}], got [{found}]"
            )
        return True


def follow(node: Node, watch: Watch, find: Find, clock: Clock | None = None) -> None:
    """Poll until all expectations are decided. Time is measured with `clock`; wall time by default.

    Raises:
        AssertionError: an expectation was not met. The error text names the first such expectation.
    """
    for elapsed_s in poll(node, watch.longest_s, clock):
        if watch.check(elapsed_s, find):
            return
