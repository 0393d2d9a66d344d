"""What the test nodes share: a node of their own, its parameters, waits, and the report."""

from __future__ import annotations

import sys
import unittest
from collections.abc import Callable, Iterator
from typing import Any

from pipros.env import Environment
from pipros.errors import NotFound
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.clock import Clock, WallClock
from pipros.node.start_params import set_private_params
from pipros.testing.program import exit_unless, run_program

# Reports leave out the frames of modules with this mark: what failed is said in words.
__unittest = True

#: How often is looked again whether what is expected came true.
LOOK_INTERVAL_S = 0.05

#: How long simulated time may take to begin.
CLOCK_TIMEOUT_S = 10.0


def run_checks(name: str, class_name: str, **checks: Callable[[Node], None]) -> None:
    """Runs checks as the cases of a test script called `name`; ends the process with 1 if one fails.

    A check fails by an AssertionError that says what was expected. Classes and cases bear the names that
    they have in Noetic, since dashboards group by them.
    """
    cases = {f"test_{what}": _case(name, check) for what, check in checks.items()}
    kind = type(class_name, (unittest.TestCase,), {**cases, "__module__": "__main__"})
    exit_unless(run_program("rostest", name, kind, sys.argv))


def _case(name: str, check: Callable[[Node], None]) -> Callable[[unittest.TestCase], None]:
    def run(_: unittest.TestCase) -> None:
        with Node(name, argv=sys.argv, environment=Environment.from_os()) as node:
            node.wait_for_master()
            set_private_params(node)
            if parameter(node, "/use_sim_time", False):
                node.use_simulated_time()
                _wait_for_time(node)
            check(node)

    return run


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
        AssertionError: it is not a number.
    """
    value = parameter(node, name, default)
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise AssertionError(f"parameter [{node.resolve(name)}] must be a number, got {value!r}")
    try:
        return float(value)
    except ValueError:
        raise AssertionError(f"parameter [{node.resolve(name)}] must be a number, got {value!r}") from None


def looks(node: Node, timeout_s: float, clock: Clock | None = None) -> Iterator[float]:
    """Comes round until the time is over, at least twice; gives the seconds since the first time.

    Args:
        clock: whose seconds they are; those of the wall when it is left out.
    """
    wall = WallClock()
    clock = clock or wall
    start_ns = clock.now_ns()
    elapsed_s = 0.0
    yield elapsed_s
    while elapsed_s < timeout_s and not node.is_shutdown:
        # Simulated time may stand still; this goes on looking.
        wall.sleep(LOOK_INTERVAL_S)
        elapsed_s = (clock.now_ns() - start_ns) / NS_PER_S
        yield elapsed_s


def _wait_for_time(node: Node) -> None:
    for _ in looks(node, CLOCK_TIMEOUT_S):
        if node.clock.now_ns():
            return
    raise AssertionError(f"/use_sim_time is true, and nobody published on /clock for {CLOCK_TIMEOUT_S:g} s")
