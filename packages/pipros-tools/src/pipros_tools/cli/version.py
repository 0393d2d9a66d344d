"""`pipros version`: prints the versions to include in a bug report."""

from __future__ import annotations

import json
import os
import platform
import sys
from argparse import ArgumentParser
from collections.abc import Sequence

import pipros
from pipros_tools.cli.entry_point import command


@command
def main(argv: Sequence[str] | None = None) -> int:
    parser = ArgumentParser(
        prog="pipros version", description="Print the versions of pipros, Python and ROS."
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    versions = versions_of_process()
    if options.json:
        print(json.dumps(versions))
    else:
        width = max(map(len, versions))
        for name, version in versions.items():
            print(f"{name:{width}}  {version}")
    return 0


def versions_of_process() -> dict[str, str]:
    """Return the versions and paths to print, keyed by label, in order."""
    from pipros_tools.cli.rosversion import DISTRO

    return {
        "pipros": pipros.__version__,
        "ros": os.environ.get("ROS_DISTRO") or DISTRO,
        "python": f"{platform.python_version()} ({sys.executable})",
        "system": platform.platform(),
        "location": os.path.dirname(os.path.abspath(pipros.__file__)),
    }
