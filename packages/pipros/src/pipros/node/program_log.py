"""Logs of programs other than running nodes: log files for tools, and standard error for servers."""

from __future__ import annotations

import logging
import os
import sys
from pathlib import Path

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.basics.posix import give_to
from pipros.node.log import configure_by_file, find_log_config, open_file_handler


def log_program(logname: str, level: int, filename: str | None, environment: Environment) -> Path | None:
    """Write all of the process's log records to a file in the ROS log folder.

    Args:
        logname: the first part of the file name, `<logname>-<pid>.log`.
        level: the lowest level to write; ignored if a configuration file is used.
        filename: the file name to use instead. If it includes a folder, `latest` links to that folder.

    Returns:
        The file; None if its folder cannot be created, which is reported on stderr.

    Raises:
        PiprosError: the log folder is a file, or the logging configuration cannot be used.
    """
    path = environment.log_dir / (filename or f"{logname or 'unknown'}-{os.getpid()}.log")
    folder = path.parent
    if folder.is_file():
        raise PiprosError(f"Cannot save log files: file [{folder}] is in the way")
    try:
        make_folders_as_parent(folder)
    except OSError as error:
        print(
            f"WARNING: cannot create log directory [{folder}]: {error.strerror}. "
            "Please set ROS_LOG_DIR to a writable location.",
            file=sys.stderr,
        )
        return None
    if folder != environment.log_dir:
        _link(folder)
    os.environ["ROS_LOG_FILENAME"] = str(path)
    config = find_log_config(environment)
    if config is not None and configure_by_file(config, path):
        return path
    root = logging.getLogger()
    root.addHandler(open_file_handler(path))
    root.setLevel(min(root.level or level, level))
    return path


def stderr_logger(name: str) -> logging.Logger:
    """Return a logger that writes records of level INFO and above, with the level, to standard error."""
    log = logging.getLogger(name)
    log.setLevel(logging.INFO)
    if not log.handlers:
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter("[%(levelname)s] %(message)s"))
        log.addHandler(handler)
        log.propagate = False
    return log


def make_folders_as_parent(folder: Path) -> None:
    """Create a folder and its missing parents, each with the owner and mode of its own parent.

    Raises:
        OSError: a folder cannot be created.
    """
    folder = folder.absolute()
    if folder.exists():
        return
    make_folders_as_parent(folder.parent)
    folder.mkdir(exist_ok=True)
    above, made = folder.parent.stat(), folder.stat()
    if (above.st_uid, above.st_gid) != (made.st_uid, made.st_gid):
        give_to(folder, above.st_uid, above.st_gid)
    if above.st_mode != made.st_mode:
        folder.chmod(above.st_mode)


def link_latest(folder: Path) -> bool:
    """Point the link `latest`, which is next to `folder`, to `folder`.

    Return False if `latest` exists and is not a link.

    Raises:
        OSError: the link cannot be created.
    """
    latest = folder.parent / "latest"
    if latest.is_symlink():
        latest.unlink()
    elif latest.exists():
        return False
    latest.symlink_to(folder)
    return True


def _link(folder: Path) -> None:
    try:
        is_linked = link_latest(folder)
    except OSError as error:
        print(f"INFO: cannot create a symlink to latest log directory: {error}", file=sys.stderr)
    else:
        if not is_linked:
            print("INFO: cannot create a symlink to latest log directory", file=sys.stderr)
