"""Topics and services that a test wants to be there, or not to be there, each within its time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pipros.node import Node
from pipros.node.clock import Clock
from pipros.testing.nodes.program import looks, parameter

# Reports leave out the frames of modules with this mark: what failed is said in words.
__unittest = True

#: How long a topic or service may take to appear when the test does not say.
DEFAULT_TIMEOUT_S = 10.0


@dataclass(frozen=True, slots=True)
class Expectation:
    """One entry of a list of topics or services to check.

    Attributes:
        name: the global name.
        timeout_s: how long it may take to appear; for a negative one, how long it must stay away.
        negative: it must not be there.
        type: its type, if that matters.
    """

    name: str
    timeout_s: float = DEFAULT_TIMEOUT_S
    negative: bool = False
    type: str | None = None

    @classmethod
    def read(cls, entry: Any, resolve: Callable[[str], str]) -> Expectation:
        """Reads `{name: …, timeout: …, negative: …, type: …}`, where all but the name may be missing.

        Raises:
            AssertionError: the entry is not a dictionary with a name, or its timeout not a number.
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
    """The list that a parameter holds; empty when it is not set.

    Raises:
        AssertionError: it is not a list of expectations.
    """
    entries = parameter(node, name, [])
    if not isinstance(entries, list):
        raise AssertionError(f"parameter [{node.resolve(name)}] must be a list, got {entries!r}")
    return [Expectation.read(entry, node.resolve) for entry in entries]


Find = Callable[[Expectation], str | None]
"""Gives the type of what is expected when it is there, else None."""


class Watch:
    """Several expectations, all of which run from the same moment on. Pure: the time is passed in.

    >>> watch = Watch([Expectation("/level", 2.0)], "topic")
    >>> watch.look(0.5, lambda one: None)
    False
    >>> watch.look(1.0, lambda one: "std_msgs/String")
    True
    """

    def __init__(self, expected: list[Expectation], what: str) -> None:
        self._open = expected
        self._what = what

    @property
    def longest_s(self) -> float:
        return max((one.timeout_s for one in self._open), default=0.0)

    def look(self, elapsed_s: float, find: Find) -> bool:
        """Looks at all that are not decided yet; True when none is left.

        Raises:
            AssertionError: one did not come true.
        """
        self._open = [one for one in self._open if not self._is_decided(one, elapsed_s, find(one))]
        return not self._open

    def _is_decided(self, one: Expectation, elapsed_s: float, found: str | None) -> bool:
        is_over = elapsed_s >= one.timeout_s
        if found is None:
            if is_over and not one.negative:
                raise AssertionError(f"{self._what} [{one.name}] did not appear within {one.timeout_s:g} s")
            return is_over
        if one.negative:
            raise AssertionError(f"{self._what} [{one.name}] is there, and must not be")
        if one.type not in (None, found):
            raise AssertionError(f"{self._what} [{one.name}] has the type [{found}], not [{one.type}]")
        return True


def follow(node: Node, watch: Watch, find: Find, clock: Clock | None = None) -> None:
    """Looks until all is decided, in the time of the wall or of `clock`.

    Raises:
        AssertionError: naming the first expectation that did not come true.
    """
    for elapsed_s in looks(node, watch.longest_s, clock):
        if watch.look(elapsed_s, find):
            return
