"""Windows's ways: paths with backslashes, and files that are open elsewhere.

On other systems, the functions do what needs no special way there.
"""

from __future__ import annotations

import codecs
import os
import sys
import time

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

ON_WINDOWS = os.name == "nt"

CONSOLE_ENCODING = "oem" if hasattr(codecs, "oem_encode") else "utf-8"
"""The encoding of batch files, and of what `for /f` reads from a program."""

_OPEN_ELSEWHERE_S = 2.0
"""Virus scanners and indexers open new files for a moment."""
_AGAIN_S = 0.05


def with_slashes(path: str) -> str:
    """Return a path with forward slashes, as in CMake and URLs. Elsewhere, a backslash is part of a name."""
    return path.replace("\\", "/") if ON_WINDOWS else path


def file_url(path: str) -> str:
    """Return a path as `file:///C:/folder`; elsewhere, `file:///folder`. Nothing is escaped."""
    return f"file://{'/' if ON_WINDOWS else ''}{with_slashes(path)}"


def path_of_url(url: str) -> str:
    """Return the path that a `file://` URL names, as it is written there."""
    path = url[len("file://") :]
    return path[1:] if ON_WINDOWS and path[2:3] == ":" else path


def replace_file(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    sleep: Callable[[float], object] = time.sleep,
) -> None:
    """Rename a file, replacing the target. On Windows, wait up to 2 s for programs that have a file open.

    Raises:
        OSError: the file cannot be renamed.
    """
    for _ in range(round(_OPEN_ELSEWHERE_S / _AGAIN_S) if ON_WINDOWS else 0):
        try:
            os.replace(source, target)
        except PermissionError:
            sleep(_AGAIN_S)
        else:
            return
    os.replace(source, target)


def registry_values(key: str) -> dict[str, str]:
    r"""Return the texts of a key in the registry, such as `HKEY_CURRENT_USER\Environment`, by name.

    Return nothing for a key that does not exist or cannot be read, and on other systems.
    """
    found: dict[str, str] = {}
    if sys.platform == "win32":
        import winreg

        root, _, path = key.partition("\\")
        try:
            with winreg.OpenKey(getattr(winreg, root), path) as opened:
                for number in range(winreg.QueryInfoKey(opened)[1]):
                    name, value, _ = winreg.EnumValue(opened, number)
                    if isinstance(value, str):
                        found[name] = value
        except OSError:
            return found
    return found
