"""The folder of a run's log files: `<log folder>/<run_id>`, with a link `latest` to the newest one."""

from __future__ import annotations

import os
import socket
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from pipros.env import Environment
from pipros.errors import PiprosError

_GIGABYTE = 1_000_000_000

# People wait while the log folder is measured, and an old one has a hundred thousand files.
_MEASURING_TIME_S = 0.05


class LogFolderUnusable(PiprosError):
    """No log file can be written where it should be."""


@dataclass(frozen=True, slots=True)
class LogFolder:
    """Where the processes of one run write. `path` exists."""

    path: Path

    @classmethod
    def of_run(cls, environment: Environment, run_id: str) -> LogFolder:
        """Makes the folder of a run and points `latest` to it.

        Raises:
            LogFolderUnusable: with what to do about it.
        """
        root = environment.log_dir.expanduser().absolute()
        folder = root / run_id
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _unusable(folder, error) from None
        if run_id:
            _point_latest(root / "latest", folder)
        return cls(folder)

    def file_of_launcher(self, program: str = "roslaunch") -> Path:
        """The log file of the process that starts the others."""
        return self.path / f"{program}-{socket.gethostname()}-{os.getpid()}.log"

    def stem(self, process_name: str) -> str:
        """The path of a process's log files without their ends; `g/talker-2` becomes `…/g-talker-2`."""
        return str(self.path / process_name.replace("/", "-"))

    def check_writable(self) -> None:
        """Raises LogFolderUnusable when no file can be made in the folder, or the disk is full."""
        probe = self.path / f".pipros-{os.getpid()}"
        try:
            probe.write_bytes(b"\0" * 4096)
        except OSError as error:
            raise _unusable(self.path, error) from None
        finally:
            with suppress(OSError):
                probe.unlink()


def _unusable(folder: Path, error: OSError) -> LogFolderUnusable:
    return LogFolderUnusable(
        f"cannot write log files to [{folder}]: {error.strerror}. Free some space or fix the permissions, "
        "or set ROS_LOG_DIR to another folder"
    )


def _point_latest(link: Path, folder: Path) -> None:
    """Renames a new link over the old one, so that two runs that start at once do not disturb each other."""
    unfinished = link.with_name(f".latest-{os.getpid()}")
    with suppress(OSError):
        unfinished.symlink_to(folder)
        os.replace(unfinished, link)


def measure(root: Path) -> tuple[int, bool]:
    """The bytes below a folder, and whether all of it was seen in the short time that this may take."""
    deadline = time.monotonic() + _MEASURING_TIME_S
    total = 0
    for folder, _, files in os.walk(root):
        for name in files:
            with suppress(OSError):
                total += os.lstat(os.path.join(folder, name)).st_size
        if time.monotonic() > deadline:
            return total, False
    return total, True


def disk_usage_report(root: Path) -> str:
    """The line that says whether the log folder has grown large."""
    total, is_complete = measure(root)
    if total >= _GIGABYTE:
        return (
            f"WARNING: disk usage in log directory [{root}] is over 1GB.\n"
            "It's recommended that you use the 'rosclean' command."
        )
    if not is_complete:
        return "Done checking log file disk usage. There are too many files to measure it quickly."
    return "Done checking log file disk usage. Usage is <1GB."
