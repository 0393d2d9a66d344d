"""`roswtf` for plugins and other Python code: rules, and the context that they look at.

Facade of `pipros.health.wtf`; see http://wiki.ros.org/roswtf.
"""

from __future__ import annotations

import sys

from pipros.cli.roswtf import main as _main
from pipros.health.wtf.context import WtfContext
from pipros.health.wtf.report import print_results as print_results
from pipros.lazy_names import star_names as _star_names

__all__ = ["print_results", "roswtf_main", "yaml_results"]

_star_names(__name__, "os rosgraph rospkg socket sys traceback")


def roswtf_main() -> None:
    """The command, with the arguments of this process. Ends with SystemExit when something went wrong."""
    code = _main(sys.argv[1:])
    if code:
        sys.exit(code)


def yaml_results(ctx: WtfContext) -> None:
    """Prints the errors and warnings of a context as YAML: text of the rule to what its function returned."""
    import yaml

    results = {
        "warnings": {found.format_msg: found.return_val for found in ctx.warnings},
        "errors": {found.format_msg: found.return_val for found in ctx.errors},
    }
    print(yaml.safe_dump(results, default_flow_style=False))
