"""Functions for launch scripts, with Noetic's names."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.env import DEFAULT_MASTER_PORT, Environment
from pipros.basics.errors import Refused, Unreachable
from pipros.net.master_client import MasterClient
from pipros_tools.launch.arguments import split_arguments
from pipros_tools.launch.console import Console
from pipros_tools.launch.find_launch_files import resolve_files
from pipros_tools.launch.logs import disk_usage_report
from pipros_tools.launch.run_id import new_run_id
from pipros_workspace.index import PackageIndex
from roslaunch.core import FileAndArguments, Master, RLException, printerrlog, printlog

__all__ = [
    "DEFAULT_MASTER_PORT",
    "change_terminal_name",
    "check_log_disk_usage",
    "check_roslaunch",
    "get_or_generate_uuid",
    "print_file_list",
    "resolve_launch_arguments",
    "update_terminal_name",
]

_ASK_EVERY_S = 0.1


def resolve_launch_arguments(args: Sequence[str]) -> list[str]:
    """Return the paths of launch files, given as `package file.launch` or as paths.

    Raises:
        RLException: a file does not exist or is ambiguous.
    """
    return resolve_files(split_arguments(list(args))[1], PackageIndex.from_environment())


def get_or_generate_uuid(options_runid: str | None, options_wait_for_master: bool) -> str:
    """Return the given run ID, if any; otherwise the running master's run ID, or a new one.

    Args:
        options_wait_for_master: whether to wait for a master with a run ID instead of generating an ID.
    """
    if options_runid:
        return options_runid
    client = MasterClient(Environment.from_os().master_uri, "/roslaunch", timeout_s=5.0)
    try:
        while True:
            try:
                return str(client.get_param("/run_id"))
            except (Unreachable, Refused):
                if not options_wait_for_master:
                    return new_run_id()
                time.sleep(_ASK_EVERY_S)
    finally:
        client.close()


def _wait_for_master() -> None:
    """Block until a master responds."""
    master = Master()
    if not master.is_running():
        printlog("roscore/master is not yet running, will wait for it to start")
        while not master.is_running():
            time.sleep(_ASK_EVERY_S)
    printlog("master has started, initiating launch")


def check_log_disk_usage() -> None:
    """Check the disk usage of the log folder, and print the result."""
    printlog("Checking log directory for disk usage. This may take a while.\nPress Ctrl-C to interrupt")
    printlog(disk_usage_report(Environment.from_os().log_dir))


def check_roslaunch(f: str, use_test_depends: bool = False, ignore_unset_args: bool = False) -> str | None:
    """Return the errors in a launch file and its includes as one text, or None if there are none.

    Missing package dependencies are also printed to standard error.

    Args:
        use_test_depends: whether `test_depend` counts as a declared dependency.
        ignore_unset_args: whether arguments without a value are allowed.
    """
    from pipros_tools.launch.check import mistakes

    found = mistakes(
        Path(os.path.abspath(f)),
        PackageIndex.from_environment(),
        with_test_depends=use_test_depends,
        ignore_unset=ignore_unset_args,
    )
    for mistake in found:
        if mistake.startswith("Missing package dependencies"):
            printerrlog(mistake)
    return "\n".join(found) if found else None


def print_file_list(roslaunch_files: Sequence[FileAndArguments]) -> None:
    """Print the paths of the given launch files and of all files that they include.

    Exit with code 1 if a file is invalid.
    """
    from roslaunch.config import get_roscore_filename, load_config_default

    try:
        config = load_config_default(roslaunch_files, None, assign_machines=False)
    except RLException as error:
        print(error, file=sys.stderr)
        sys.exit(1)
    core = get_roscore_filename()
    for file in dict.fromkeys(config.roslaunch_files):
        if file != core:
            print(os.path.abspath(file))


def change_terminal_name(args: Sequence[str], is_core: bool) -> None:
    """Set the terminal title to the given file names, or to `roscore` for a core."""
    _title.name = "roscore" if is_core else ",".join(args)
    _title.show(_title.name)


def update_terminal_name(ros_master_uri: str) -> None:
    """Append the master's URI to the terminal title."""
    if _title.name:
        _title.show(f"{_title.name} {ros_master_uri}")


class _Title:
    """The terminal title; empty until it is set."""

    def __init__(self) -> None:
        self.name = ""

    def show(self, text: str) -> None:
        Console().title(text)


_title = _Title()
