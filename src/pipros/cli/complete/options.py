"""The subcommands and options of ROS commands, for shell completion."""

from __future__ import annotations

import contextlib
import io
import re
import sys
from collections.abc import Sequence
from importlib import import_module

SUBCOMMANDS = {
    "rosaction": "info list md5 package packages show",
    "rosbag": "check compress convert decompress decrypt encrypt export filter fix help info play record "
    "reindex",
    "pipros": "clients doctor env fleet foxglove graph ros2 serve stubs version",
    "rosclean": "check purge",
    "rosconsole": "echo get list set",
    "rosmsg": "info list md5 package packages show",
    "rosnode": "cleanup info kill list machine ping",
    "rospack": "cflags-only-I cflags-only-other depends depends-indent depends-manifests depends-msgsrv "
    "depends-on depends-on1 depends-why depends1 export find help langs libs-only-L libs-only-l "
    "libs-only-other list list-duplicates list-names plugins profile rosdep rosdep0 vcs vcs0",
    "rosparam": "delete dump get list load set",
    "rosservice": "args call find info list type uri",
    "rossrv": "info list md5 package packages show",
    "rosstack": "contains contains-path contents depends depends-indent depends-manifests depends-on "
    "depends-on1 depends-why depends1 find help list list-names profile",
    "rostopic": "bw delay echo find hz info list pub type",
}


def options(command: str, before: Sequence[str]) -> list[str]:
    """Return the long options of a command or its subcommand.

    The options are found in the help text, so this works for optparse, argparse and hand-written parsers.
    """
    if command in ("roscd", "rosls", "rosed", "roscat", "roscp", "rosmv", "rospd"):
        return ["--help"]
    try:
        module = import_module(f"pipros.cli.{command.replace('-', '_')}")
    except ImportError:
        return []
    if not hasattr(module, "main"):
        return []
    subcommand = [word for word in before if not word.startswith("-")][:1] if command in SUBCOMMANDS else []
    help_text = io.StringIO()
    arguments, sys.argv = sys.argv, [command]
    try:
        with (
            contextlib.redirect_stdout(help_text),
            contextlib.redirect_stderr(help_text),
            contextlib.suppress(SystemExit),
        ):
            module.main([*subcommand, "--help"])
    finally:
        sys.argv = arguments
    return sorted(set(re.findall(r"(?<![\w-])--[a-z][\w-]*", help_text.getvalue())))
