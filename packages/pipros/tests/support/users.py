"""Files that belong to other users, and programs that run as another user."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

STRANGER = 23456
"""A user id without an account."""

needs_other_users = pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can act for other users"
)


def give_away(path: Path, owner: int = STRANGER) -> None:
    """Make another user the owner of a file, a link, or a folder with its contents. Needs root."""
    for entry in [path, *(path.rglob("*") if path.is_dir() and not path.is_symlink() else ())]:
        os.chown(entry, owner, owner, follow_symlinks=False)


def _can_be_nobody() -> bool:
    made = subprocess.run([*NOBODY, "true"], capture_output=True, check=False) if NOBODY[0] else None
    return made is not None and made.returncode == 0


NOBODY = (shutil.which("unshare") or "", "--user", f"--map-user={STRANGER}", f"--map-group={STRANGER}")
"""Prefix for a command, which then runs as a user without an account, but with the rights of the tests."""

needs_nobody = pytest.mark.skipif(not _can_be_nobody(), reason="needs user namespaces of Linux")
