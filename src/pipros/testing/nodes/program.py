"""What the test nodes share: a node of their own, its parameters, and the report."""

from __future__ import annotations

import sys
import unittest
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pipros.env import Environment
from pipros.errors import NotFound
from pipros.node import Node
from pipros.testing.program import exit_unless, run_program

#: How long a topic or service may take to appear when the test does not say.
DEFAULT_TIMEOUT_S = 10.0

#: How often the master is asked again.
LOOK_INTERVAL_S = 0.1


def run_check(name: str, check: Callable[[Node], None]) -> None:
    """Runs `check` as the only case of a test script called `name`; ends the process with 1 if it fails.

    A check fails by an AssertionError that says what was expected.
    """

    def run(_: unittest.TestCase) -> None:
        with Node(name, argv=sys.argv, environment=Environment.from_os()) as node:
            node.wait_for_master()
            if parameter(node, "/use_sim_time", False):
                node.use_simulated_time()
            check(node)

    case = type(f"{name.capitalize()}Case", (unittest.TestCase,), {f"test_{name.removesuffix('test')}": run})
    exit_unless(run_program("rostest", name, case, sys.argv))


_REQUIRED = object()


def parameter(node: Node, name: str, default: Any = _REQUIRED) -> Any:
    """A parameter of the test; without a default it must be set.

    Raises:
        AssertionError: it is not set.
    """
    try:
        return node.params.get(name)
    except NotFound:
        if default is _REQUIRED:
            raise AssertionError(f"parameter [{node.resolve(name)}] is not set") from None
        return default


def number(node: Node, name: str, default: Any = _REQUIRED) -> float:
    """A parameter that must be a number.

    Raises:
        AssertionError: it is none.
    """
    value = parameter(node, name, default)
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise AssertionError(f"parameter [{node.resolve(name)}] is no number: {value!r}")
    try:
        return float(value)
    except ValueError:
        raise AssertionError(f"parameter [{node.resolve(name)}] is no number: {value!r}") from None


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
    timeout_s: float
    negative: bool
    type: str | None

    @classmethod
    def read(cls, node: Node, entry: Any) -> Expectation:
        """Raises:
        AssertionError: the entry is no dictionary with a name.
        """
        if not isinstance(entry, Mapping) or not isinstance(entry.get("name"), str):
            raise AssertionError(
                f"'name' is missing in {entry!r}: needed is {{name: …, timeout: …, negative: …}}"
            )
        return cls(
            node.resolve(entry["name"]),
            float(entry.get("timeout", DEFAULT_TIMEOUT_S)),
            bool(entry.get("negative", False)),
            entry.get("type"),
        )


def expectations(node: Node, name: str) -> list[Expectation]:
    """The list that a parameter holds; empty when it is not set."""
    entries = parameter(node, name, [])
    if not isinstance(entries, list):
        raise AssertionError(f"parameter [{node.resolve(name)}] is no list: {entries!r}")
    return [Expectation.read(node, entry) for entry in entries]


def looks(node: Node, timeout_s: float) -> Iterator[None]:
    """Comes round until the time is over, at least once."""
    end_ns = node.clock.now_ns() + int(timeout_s * 1e9)
    yield
    while node.clock.now_ns() < end_ns and not node.is_shutdown:
        node.clock.sleep(LOOK_INTERVAL_S)
        yield


def check_all(
    node: Node, expected: list[Expectation], find: Callable[[Expectation], str | None], *, what: str
) -> None:
    """Checks that each expectation comes true in its time. `find` gives the type of what is there, or None.

    Raises:
        AssertionError: naming the first that does not.
    """
    for one in expected:
        found: str | None = None
        for _ in looks(node, one.timeout_s):
            found = find(one)
            if found is not None:
                break
        if one.negative:
            if found is not None:
                raise AssertionError(f"{what} [{one.name}] is there, and must not be")
        elif found is None:
            raise AssertionError(f"{what} [{one.name}] did not appear within {one.timeout_s:g} s")
        elif one.type not in (None, found):
            raise AssertionError(f"{what} [{one.name}] has the type [{found}], not [{one.type}]")
