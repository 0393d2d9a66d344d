"""Helpers that launch scripts call, under Noetic's names."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.cli.roslaunch import split_arguments
from pipros.env import Environment
from pipros.errors import Refused, Unreachable
from pipros.launch.core import new_run_id
from pipros.launch.files import resolve_files
from pipros.launch.logs import disk_usage_report
from pipros.net.master import MasterClient
from pipros.workspace.index import PackageIndex

FileAndArguments = str | tuple[str, Sequence[str]]
"""A launch file, alone or with the `name:=value` words for it."""


def split_file(entry: FileAndArguments) -> tuple[str, dict[str, str]]:
    """The file and its arguments."""
    if isinstance(entry, str):
        return entry, {}
    file, words = entry
    return file, split_arguments(list(words))[0]


def resolve_launch_arguments(args: Sequence[str]) -> list[str]:
    """The launch files that `package file.launch`, or paths, mean.

    Raises:
        RLException: when there are none.
    """
    return resolve_files(split_arguments(list(args))[1], PackageIndex.from_environment())


def get_or_generate_uuid(options_runid: str | None, options_wait_for_master: bool) -> str:
    """The run of the master that answers; else the one given, else a new one."""
    client = MasterClient(Environment.from_os().master_uri, "/roslaunch", timeout_s=5.0)
    try:
        if options_wait_for_master:
            import time

            while True:
                try:
                    client.get_pid()
                    break
                except Unreachable:
                    time.sleep(0.1)
        return str(client.get_param("/run_id"))
    except (Unreachable, Refused):
        return options_runid or new_run_id()
    finally:
        client.close()


def check_log_disk_usage() -> None:
    """Says how large the log folder is."""
    print(disk_usage_report(Environment.from_os().log_dir))
