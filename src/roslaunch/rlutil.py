"""Functions that launch scripts call, under Noetic's names."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.env import Environment
from pipros.errors import Refused, Unreachable
from pipros.launch.arguments import split_arguments
from pipros.launch.find_launch_files import resolve_files
from pipros.launch.logs import disk_usage_report
from pipros.launch.run_id import is_run_id, new_run_id
from pipros.net.master_client import MasterClient
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
    """The launch files for `package file.launch`, or paths.

    Raises:
        RLException: a file does not exist.
    """
    return resolve_files(split_arguments(list(args))[1], PackageIndex.from_environment())


def get_or_generate_uuid(options_runid: str | None, options_wait_for_master: bool) -> str:
    """The run id of the running master if it is a valid one; else the one given, else a new one."""
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
        run_id = client.get_param("/run_id")
    except (Unreachable, Refused):
        run_id = None
    finally:
        client.close()
    return str(run_id) if is_run_id(run_id) else options_runid or new_run_id()


def check_log_disk_usage() -> None:
    """Prints whether the log folder has grown large."""
    print(disk_usage_report(Environment.from_os().log_dir))
