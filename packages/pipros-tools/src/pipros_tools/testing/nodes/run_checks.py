"""Shared code of the test nodes: the node, its parameters, polling, and the report."""

from __future__ import annotations

import sys
import unittest
from collections.abc import Callable, Iterator
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.errors import NotFound
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.clock import Clock, WallClock
from pipros.node.start_params import set_private_params
from pipros_tools.testing.script_runner import exit_unless, run_program

# unittest's reports omit the frames of modules that define this variable.
__unittest = True

POLL_INTERVAL_S = 0.05
"""Interval at which conditions are checked."""

CLOCK_TIMEOUT_S = 10.0
"""Time limit for the first message on /clock."""


def run_checks(
    name: str,
    class_name: str,
    *,
    needs_time: Callable[[Node], bool] = lambda _: True,
    **checks: Callable[[Node], None],
) -> None:
    """Run checks as the test cases of a test script called `name`. Exit with code 1 if a check fails.

    If time is simulated, each check waits until the clock runs, unless `needs_time` returns False. A check
    fails with an AssertionError that states the expectation. Classes and cases have Noetic's names, because
    dashboards group results by these names.
    """
    cases = {f"test_{what}": _case(name, check, needs_time) for what, check in checks.items()}
    kind = type(class_name, (unittest.TestCase,), {**cases, "__module__": "__main__"})
    exit_unless(run_program("rostest", name, kind, sys.argv))


def _case(
    name: str, check: Callable[[Node], None], needs_time: Callable[[Node], bool]
) -> Callable[[unittest.TestCase], None]:
    def run(_: unittest.TestCase) -> None:
        with Node(name, argv=sys.argv, environment=Environment.from_os()) as node:
            node.wait_for_master()
            set_private_params(node)
            if needs_time(node) and parameter(node, "/use_sim_time", False):
                node.use_simulated_time()
                _wait_for_time(node)
            check(node)

    return run


_REQUIRED = object()


def parameter(node: Node, name: str, default: Any = _REQUIRED) -> Any:
    """Return one of the test's parameters. The parameter is required if there is no default.

    Raises:
        AssertionError: the parameter is not set.
    """
    try:
        return node.params.get(name)
    except NotFound:
        if default is _REQUIRED:
            raise AssertionError(f"parameter [{node.resolve(name)}] is not set") from None
        return default


def number(node: Node, name: str, default: Any = _REQUIRED) -> float:
    """Return a numeric parameter. A string that contains a number is accepted, too.

    Raises:
        AssertionError: the parameter is not set, or is not a number.
    """
    value = parameter(node, name, default)
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise AssertionError(f"parameter [{node.resolve(name)}] must be a number, got {value!r}")
    try:
        return float(value)
    except ValueError:
        raise AssertionError(f"parameter [{node.resolve(name)}] must be a number, got {value!r}") from None


def poll(node: Node, timeout_s: float, clock: Clock | None = None) -> Iterator[float]:
    """Yield 0, then the elapsed seconds at intervals, until `timeout_s` has elapsed or the node is shut down.

    Args:
        clock: the clock to measure with; wall time by default.
    """
    wall = WallClock()
    clock = clock or wall
    start_ns = clock.now_ns()
    elapsed_s = 0.0
    yield elapsed_s
    while elapsed_s < timeout_s and not node.is_shutdown:
        # Sleep in wall time, because simulated time may be paused.
        wall.sleep(POLL_INTERVAL_S)
        elapsed_s = (clock.now_ns() - start_ns) / NS_PER_S
        yield elapsed_s


def _wait_for_time(node: Node) -> None:
    for _ in poll(node, CLOCK_TIMEOUT_S):
        if node.clock.now_ns():
            return
    raise AssertionError(
        f"/use_sim_time is true, but no message arrived on /clock within {CLOCK_TIMEOUT_S:g} s"
    )
