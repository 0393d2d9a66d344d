"""`roswtf` for plugins and other Python code: rules, and the context that they look at.

Facade of `pipros.health.wtf`; see http://wiki.ros.org/roswtf.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import wraps

from pipros.basics.lazy_names import star_names as _star_names
from pipros.cli.roswtf import main as _main
from pipros.health.wtf.context import WtfContext
from pipros.health.wtf.report import print_results as print_results

__all__ = ["print_results", "roswtf_main", "yaml_results"]


@wraps(_main)
def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; its plugins find a node of rospy."""
    return _main(argv, start_node=_start_node)


def _start_node() -> None:
    import rospy

    rospy.init_node("roswtf", anonymous=True)


_star_names(__name__, "os rosgraph rospkg socket sys traceback")


def roswtf_main() -> None:
    """Run the command with the arguments of this process; SystemExit with its exit code if that is not 0."""
    code = main(sys.argv[1:])
    if code:
        sys.exit(code)


def yaml_results(ctx: WtfContext) -> None:
    """Prints the errors and warnings of a context as YAML.

    Maps each rule's text to the value that its function returned.
    """
    import yaml

    results = {
        "warnings": {found.format_msg: found.return_val for found in ctx.warnings},
        "errors": {found.format_msg: found.return_val for found in ctx.errors},
    }
    print(yaml.safe_dump(results, default_flow_style=False))
