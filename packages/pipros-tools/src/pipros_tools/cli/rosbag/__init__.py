"""`rosbag`: records, plays and processes bag files."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from functools import partial

from pipros.basics.interrupts import accept_ctrl_c, ended_by_termination
from pipros.basics.plugins import loaded, verbs
from pipros_tools.cli.entry_point import OutputFailed, command
from pipros_tools.cli.runner import CommandError, Subcommand, run

_DESCRIPTIONS = {
    "check": "Determine whether a bag is playable in the current system, or if it can be migrated.",
    "compress": "Compress one or more bag files.",
    "convert": "Convert between bag files, MCAP files and other formats.",
    "decompress": "Decompress one or more bag files.",
    "decrypt": "Decrypt one or more bag files.",
    "encrypt": "Encrypt one or more bag files.",
    "export": "Export topics to tables, NumPy files and image files.",
    "filter": "Filter the contents of the bag.",
    "fix": "Repair the messages in a bag file so that it can be played in the current system.",
    "help": "",
    "info": "Summarize the contents of one or more bag files.",
    "merge": "Merge several bag files into one.",
    "play": "Play back the contents of one or more bag files in a time-synchronized fashion.",
    "record": "Record a bag file with the contents of specified topics.",
    "reindex": "Reindexes one or more bag files.",
    "split": "Split a bag file by time or size.",
}
_HOMES = {
    "compress": "rewriting",
    "decompress": "rewriting",
    "reindex": "rewriting",
    "decrypt": "encryption",
    "encrypt": "encryption",
    "check": "migrating",
    "convert": "converting",
    "export": "exporting",
    "filter": "filtering",
    "fix": "migrating",
    "info": "info",
    "merge": "merging",
    "split": "merging",
    "play": "playing",
    "record": "recording",
}
_NODES = ("play", "record")
"""Subcommands that run a node: they handle signals themselves, and end on SIGINT even if SIGINT was ignored
when they were started.
"""

_USAGE = """\
Usage: rosbag <subcommand> [options] [args]

A bag is a file format in ROS for storing ROS message data. The rosbag command can record, replay and manipulate bags.

{}
For additional information, see http://wiki.ros.org/rosbag
"""  # noqa: E501


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run a subcommand and return its exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    name = arguments[0] if arguments else "help"
    if name in ("help", "-h", "--help"):
        return _help(arguments[1:])
    if not _is_known(name):
        return _explain_unknown(name)
    if name in _NODES:
        accept_ctrl_c()
    status = run(partial(_run, name, arguments[1:]))
    if status and name != "record":
        _name_recordings(arguments[1:])
    return status


def _name_recordings(paths: Sequence[str]) -> None:
    """Say how to repair the interrupted recordings of bags that do not exist."""
    for path in paths:
        if not os.path.exists(path) and os.path.exists(active := f"{path}.active"):
            advice = f"if nothing records it any more, repair it with rosbag reindex {active}, and rename it"
            print(f"There is an unfinished recording, {active}: {advice}", file=sys.stderr)


def _run(name: str, arguments: Sequence[str]) -> int:
    """Run a subcommand.

    Raises:
        CommandError: an operating system error occurred, such as a full disk.
        OutputFailed, BrokenPipeError: standard output cannot be written to.
    """
    try:
        with nullcontext() if name in _NODES else ended_by_termination():
            return _subcommand(name)(arguments)
    except (OutputFailed, BrokenPipeError):
        raise
    except OSError as error:
        path = error.filename2 or error.filename
        where = f": '{path}'" if path else ""
        raise CommandError(f"cannot {name}: {error.strerror or error}{where}") from error


def _help(arguments: Sequence[str]) -> int:
    if arguments and not _is_known(arguments[0]):
        return _explain_unknown(arguments[0])
    if arguments and arguments[0] != "help":
        return run(partial(_subcommand(arguments[0]), ["--help"]))
    print(_USAGE.format(_subcommands()))
    return 0


def _is_known(name: str) -> bool:
    return name in ("help", *_HOMES) or name in verbs("rosbag")


def _explain_unknown(name: str) -> int:
    from pipros.basics.plugin_table import NOT_INSTALLED, why_no_command

    if why := why_no_command(f"rosbag {name}"):
        print(f"ERROR: {why}", file=sys.stderr)
        return NOT_INSTALLED
    print(f"Unknown command: '{name}'\n{_subcommands()}", file=sys.stderr)
    return 0


def _subcommands() -> str:
    """Return a list of all subcommands, including those of plugins, sorted by name."""
    purposes = _DESCRIPTIONS | {name: each.purpose for name, each in verbs("rosbag").items()}
    lines = (f"   {name}  " + (f"\t{text}\n" if text else "\n") for name, text in sorted(purposes.items()))
    return "Available subcommands:\n" + "".join(lines)


def _subcommand(name: str) -> Subcommand:
    target = (
        f"pipros_tools.cli.rosbag.{_HOMES[name]}:{name}" if name in _HOMES else verbs("rosbag")[name].target
    )
    found: Subcommand = loaded(target)
    return found
