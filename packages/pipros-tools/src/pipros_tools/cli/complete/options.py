"""The subcommands and options of ROS commands, for shell completion."""

from __future__ import annotations

import contextlib
import io
import re
import sys
from collections.abc import Callable, Sequence
from importlib import import_module

from pipros.basics.plugins import loaded, named_plugins, plugins

SUBCOMMANDS = {
    "rosaction": "info list md5 package packages show",
    "rosbag": "check compress convert decompress decrypt encrypt export filter fix help info merge play "
    "record reindex split",
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


def words_after(command: str) -> list[str]:
    """Return the subcommands of a command, or an empty list."""
    if command == "pipros":
        from pipros_tools.cli.subcommands import subcommands

        return sorted(subcommands())
    known = SUBCOMMANDS.get(command)
    if known is None:
        of_plugins = (plugin.programs[command] for plugin in named_plugins() if command in plugin.programs)
        known = next((program.subcommands for program in of_plugins), "")
    return [*known.split(), *(verb for plugin in named_plugins() for verb in plugin.verbs.get(command, ()))]


def options(command: str, before: Sequence[str]) -> list[str]:
    """Return the long options of a command or its subcommand.

    The options are found in the help text, so this works for optparse, argparse and hand-written parsers.
    """
    if command in ("roscd", "rosls", "rosed", "roscat", "roscp", "rosmv", "rospd"):
        return ["--help"]
    main = _main_of(command)
    if main is None:
        return []
    words = [word for word in before if not word.startswith("-")]
    subcommand = words[:1] if words_after(command) else []
    help_text = io.StringIO()
    arguments, sys.argv = sys.argv, [command]
    try:
        with (
            contextlib.redirect_stdout(help_text),
            contextlib.redirect_stderr(help_text),
            contextlib.suppress(SystemExit),
        ):
            main([*subcommand, "--help"])
    finally:
        sys.argv = arguments
    return sorted(set(re.findall(r"(?<![\w-])--[a-z][\w-]*", help_text.getvalue())))


def _main_of(command: str) -> Callable[[list[str]], int] | None:
    """Return the main function of one of pipros's or a plugin's commands, or None if there is none."""
    found: Callable[[list[str]], int] | None
    try:
        found = getattr(import_module(f"pipros_tools.cli.{command.replace('-', '_')}"), "main", None)
    except ImportError:
        target = next(
            (plugin.programs[command].target for plugin in plugins() if command in plugin.programs), None
        )
        found = None if target is None else loaded(target)
    return found
