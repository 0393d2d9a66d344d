"""Compiler and linker flags for packages, from the `.pc` files that catkin writes and pkg-config reads."""

from __future__ import annotations

import os
import shutil
import subprocess

from pipros.basics.errors import PiprosError
from pipros_workspace.overlays import built_workspaces


class NoFlags(PiprosError):
    """pkg-config is not installed, or cannot find the package."""


def flags(package: str, option: str, prefix: str = "") -> list[str]:
    """Return the flags for a package.

    Args:
        option: pkg-config option without its dashes, such as `cflags-only-I`.
        prefix: a prefix to remove from each flag. With `-I` or `-L`, the folders are sorted, those in the
            topmost overlay first.

    Raises:
        NoFlags: pkg-config is missing or cannot find the package; the message says what to do.
    """
    program = shutil.which("pkg-config")
    command = f"pkg-config --{option} {package}"
    if program is None:
        raise NoFlags(f"'{command}' cannot be run: pkg-config is not installed")
    ended = subprocess.run(  # noqa: S603
        [program, f"--{option}", package], capture_output=True, text=True, check=False
    )
    if ended.returncode != 0:
        raise NoFlags(
            f"'{command}' failed: {ended.stderr.partition(chr(10))[0]} "
            "Only packages that genuine catkin built or installed have flags"
        )
    found = [flag.removeprefix(prefix) for flag in ended.stdout.split()]
    return sorted(found, key=_rank) if prefix in ("-I", "-L") else found


def _rank(folder: str) -> int:
    """Return the position of the workspace that contains a folder, 0 for the topmost workspace.

    Return the number of workspaces if none contains the folder.
    """
    prefixes = [str(workspace.prefix) for workspace in built_workspaces()]
    for number, prefix in enumerate(prefixes):
        if (folder + os.sep).startswith(prefix + os.sep):
            return number
    return len(prefixes)
