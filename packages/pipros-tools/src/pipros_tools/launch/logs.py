"""A run's log files, in the folder `<log folder>/<run_id>`. The link `latest` points to the newest run."""

from __future__ import annotations

import os
import socket
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.basics.log_file import refuse_planted_link, warn_unwritable
from pipros.basics.planted import UntrustedFile, refuse_planted
from pipros_tools.launch.console import Console

_GIGABYTE = 1_000_000_000

# The launch waits for the measurement, and an old log folder can contain a hundred thousand files.
_MEASURING_TIME_S = 0.05
_ALWAYS_MEASURED = 100


class LogFolderUnusable(PiprosError):
    """Another user could redirect the log files of a run."""


class LogFolder(NamedTuple):
    """The folder for the log files of all processes in one run.

    Attributes:
        path: the folder.
        is_usable: whether files could be written to it at the start. Otherwise, for example because the disk
            is full, the launcher and the nodes write to the console only, as the user has been warned.
    """

    path: Path
    is_usable: bool = True

    @classmethod
    def of_run(cls, environment: Environment, run_id: str) -> LogFolder:
        """Create a run's folder and point `latest` to it. Warn if it cannot be written to.

        Raises:
            LogFolderUnusable: another user has planted a link with the folder's name.
        """
        root = environment.log_dir.absolute()
        folder = root / run_id
        try:
            refuse_planted(root)
            try:
                folder.mkdir(parents=True, exist_ok=True)
            finally:
                with suppress(FileNotFoundError, NotADirectoryError):
                    refuse_planted_link(folder)
            _write_probe(folder)
        except UntrustedFile as error:
            raise LogFolderUnusable(
                f"cannot write log files to [{folder}]: {error.strerror}. Set ROS_LOG_DIR to another folder"
            ) from None
        except OSError as error:
            warn_unwritable(folder / "*.log", error)
            return cls(folder, is_usable=False)
        if run_id:
            _point_latest(root / "latest", folder)
        return cls(folder)

    def file_of_launcher(self, program: str = "roslaunch") -> Path:
        """Return the path of the launcher's log file."""
        return self.path / f"{program}-{socket.gethostname()}-{os.getpid()}.log"

    def stem(self, process_name: str) -> str:
        """Return the path of a process's log files without suffix; `g/talker-2` becomes `…/g-talker-2`."""
        return str(self.path / process_name.replace("/", "-"))


class LauncherLog(NamedTuple):
    """A launcher's own log.

    Attributes:
        folder: the log folder of the run.
        file: the launcher's log file in that folder.
    """

    folder: LogFolder
    file: Path

    @classmethod
    def open(cls, environment: Environment, run_id: str, console: Console) -> LauncherLog:
        """Create a run's folder, and copy the console's output to a file in it, if possible.

        Raises:
            LogFolderUnusable: see `LogFolder.of_run`.
        """
        folder = LogFolder.of_run(environment, run_id)
        file = folder.file_of_launcher()
        console.open_log(file)
        if folder.is_usable:
            console.say(f"... logging to {file}")
        return cls(folder, file)


def _write_probe(folder: Path) -> None:
    """Write a small file and delete it, because a file may be created on a full disk. Raises OSError."""
    probe = folder / f".pipros-{os.urandom(8).hex()}"
    try:
        with probe.open("xb") as file:
            file.write(b"\0" * 4096)
    finally:
        with suppress(OSError):
            probe.unlink()


def _point_latest(link: Path, folder: Path) -> None:
    """Replace the link by renaming a new one, so that two runs can start at the same time."""
    unfinished = link.with_name(f".latest-{os.getpid()}")
    with suppress(OSError):
        unfinished.symlink_to(folder)
        os.replace(unfinished, link)


def measure(root: Path, limit_s: float = _MEASURING_TIME_S) -> tuple[int, bool]:
    """Return the total size in bytes of the files below a folder, and whether all files were counted in time.

    The first hundred files are counted regardless of the time limit, because a busy machine may suspend the
    process.
    """
    deadline = time.monotonic() + limit_s
    total = count = 0
    for folder, _, files in os.walk(root):
        count += 1 + len(files)
        for name in files:
            with suppress(OSError):
                total += os.lstat(os.path.join(folder, name)).st_size
        if count > _ALWAYS_MEASURED and time.monotonic() > deadline:
            return total, False
    return total, True


def disk_usage_report(root: Path, limit_s: float = _MEASURING_TIME_S) -> str:
    """Return a message about the log folder's disk usage, with a warning if it is 1 GB or more."""
    total, is_complete = measure(root, limit_s)
    if total >= _GIGABYTE:
        return (
            f"WARNING: disk usage in log directory [{root}] is over 1GB.\n"
            "It's recommended that you use the 'rosclean' command."
        )
    if not is_complete:
        return "Done checking log file disk usage. There are too many files to measure it quickly."
    return "Done checking log file disk usage. Usage is <1GB."
