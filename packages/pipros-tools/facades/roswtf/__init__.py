"""Python API of `roswtf` for plugins: rules, and the context that they check.

Facade of `pipros_tools.health.wtf`; see http://wiki.ros.org/roswtf.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import wraps

from pipros.basics.printable import printable_lines
from pipros_tools.cli.roswtf import main as _main
from pipros_tools.health.wtf.plugins import Check, load_plugins, run_checks
from pipros_tools.health.wtf.rules import Problem, print_problems
from pipros_tools.health.wtf.subject import Subject
from roswtf.context import WtfContext

__all__ = ["print_results", "roswtf_main", "yaml_results"]


@wraps(_main)
def main(argv: Sequence[str] | None = None) -> int:
    """Run the command, with plugins that use rospy. Return the exit code."""
    return _main(argv, _Plugins())


class _Plugins:
    """The plugins' rules, all of which share one context."""

    def __init__(self) -> None:
        self._static: list[Check] = []
        self._online: list[Check] = []
        self._context = WtfContext()

    def load(self) -> None:
        self._static, self._online = load_plugins(say=print, complain=_print_error)

    def check(self, subject: Subject) -> list[Problem]:
        """Apply the checks. Before online checks, start a node, which some plugins need."""
        self._context.set_subject(subject)
        self._context.warnings, self._context.errors = [], []
        checks = self._static if subject.system is None else self._online
        if checks is self._online and checks:
            import rospy

            rospy.init_node("roswtf", anonymous=True)
        run_checks(checks, self._context, complain=_print_error)
        return _problems_of(self._context)


def _problems_of(ctx: WtfContext) -> list[Problem]:
    warnings = [Problem(False, found.msg) for found in ctx.warnings]
    return warnings + [Problem(True, found.msg) for found in ctx.errors]


def _print_error(text: str) -> None:
    print(printable_lines(text), file=sys.stderr, flush=True)


def print_results(ctx: WtfContext) -> None:
    """Print the warnings and errors in a context. On a terminal, use colours."""
    print_problems(_problems_of(ctx))


def roswtf_main() -> None:
    """Run the command with this process's arguments. Raise SystemExit if its exit code is not 0."""
    code = main(sys.argv[1:])
    if code:
        sys.exit(code)


def yaml_results(ctx: WtfContext) -> None:
    """Print the errors and warnings in a context as YAML.

    The keys `warnings` and `errors` contain mappings from rule texts to the results of their functions.
    """
    import yaml

    results = {
        "warnings": {found.format_msg: found.return_val for found in ctx.warnings},
        "errors": {found.format_msg: found.return_val for found in ctx.errors},
    }
    print(yaml.safe_dump(results, default_flow_style=False))
