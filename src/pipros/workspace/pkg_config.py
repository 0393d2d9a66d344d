"""What a compiler needs to know of a package: catkin tells pkg-config, and pkg-config tells others."""

from __future__ import annotations

import os
import shutil
import subprocess

from pipros.errors import PiprosError
from pipros.workspace.overlays import built_workspaces


class NoFlags(PiprosError):
    """pkg-config is missing, or knows nothing of the package."""


def flags(package: str, option: str, prefix: str = "") -> list[str]:
    """The flags of a package without the prefix of each, such as `-I`; folders of overlays come first.

    Args:
        option: of pkg-config, without its dashes: `cflags-only-I`.

    Raises:
        NoFlags: with what to do.
    """
    program = shutil.which("pkg-config")
    command = f"pkg-config --{option} {package}"
    if program is None:
        raise NoFlags(f"'{command}' is needed for compiler flags, and pkg-config is not installed")
    ended = subprocess.run(  # noqa: S603
        [program, f"--{option}", package], capture_output=True, text=True, check=False
    )
    if ended.returncode != 0:
        raise NoFlags(
            f"'{command}' failed: {ended.stderr.partition(chr(10))[0]} Only genuine catkin tells pkg-config "
            "about a package, where it builds or installs it"
        )
    found = [flag.removeprefix(prefix) for flag in ended.stdout.split()]
    return sorted(found, key=_rank) if prefix in ("-I", "-L") else found


def _rank(folder: str) -> int:
    """The place of the workspace that a folder lies in, from the topmost overlay down."""
    prefixes = [str(workspace.prefix) for workspace in built_workspaces()]
    for number, prefix in enumerate(prefixes):
        if (folder + os.sep).startswith(prefix + os.sep):
            return number
    return len(prefixes)
