"""`paramtest`: checks that a parameter is set, optionally to a given value.

Private parameters: `param_name_target`, `param_value_expected` (optional), `wait_time` (20 s) for the
parameter to be set, and then `test_duration` (5 s) for the parameter to get the expected value.
"""

from __future__ import annotations

from pipros.node import Node
from pipros_tools.testing.nodes.run_checks import number, parameter, poll, run_checks

# unittest's reports omit the frames of modules that define this variable.
__unittest = True

_UNSET = object()


def check(node: Node) -> None:
    """Raise AssertionError if the parameter does not get the expected value in time."""
    target = str(parameter(node, "~param_name_target"))
    expected = parameter(node, "~param_value_expected", None)
    duration = number(node, "~test_duration", 5)
    if duration <= 0 or not target:
        raise AssertionError(
            f"bad parameters: test_duration {duration:g} must be positive, "
            f"and param_name_target [{target}] must not be empty"
        )
    value: object = _UNSET
    for _ in poll(node, number(node, "~wait_time", 20)):
        value = parameter(node, target, _UNSET)
        if value is not _UNSET:
            break
    if value is _UNSET:
        raise AssertionError(f"parameter [{node.resolve(target)}] was not set in time")
    if expected is None:
        return
    for _ in poll(node, duration):
        value = parameter(node, target, _UNSET)
        if value == expected:
            return
    raise AssertionError(f"parameter [{node.resolve(target)}] is {value!r}, not {expected!r}")


def main() -> None:
    run_checks("paramtest", "ParamTest", needs_time=lambda _: False, param=check)
