"""The command `rosconsole` as a function. Facade of `pipros_tools.cli.rosconsole`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import NoReturn

from pipros.basics.lazy_names import star_names as _star_names
from pipros_tools.cli.rosconsole import main as _main
from rospy.logger_level_service_caller import LoggerLevelServiceCaller, ROSConsoleException

__all__ = ["NAME", "LoggerLevelServiceCaller", "ROSConsoleException", "error", "main"]

_star_names(
    __name__,
    "argparse:ArgumentParser datetime:datetime rosgraph_msgs.msg:Log os re rosgraph rospy socket sys "
    "dateutil.tz.tz:tzlocal",
)

NAME = "rosconsole"


def error(status: int, msg: str) -> NoReturn:
    """Print the command's error message and end the process with `status`."""
    print(f"{NAME}: error: {msg}", file=sys.stderr)
    sys.exit(status)


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command. `argv` starts with the command's name. Raises SystemExit if an error occurs."""
    code = _main(list(sys.argv if argv is None else argv)[1:])
    if code:
        sys.exit(code)
