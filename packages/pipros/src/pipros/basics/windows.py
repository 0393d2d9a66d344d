"""Windows's ways: paths with backslashes, drives, names without case, and files that are open elsewhere.

On other systems, the functions do what needs no special way there.
"""

from __future__ import annotations

import codecs
import errno
import os
import stat
import sys
import time

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

ON_WINDOWS = os.name == "nt"

SETUP_FILE = r"devel\setup.bat" if ON_WINDOWS else "devel/setup.bash"
"""The setup file of a built workspace, as advice names it."""

CONSOLE_ENCODING = "oem" if hasattr(codecs, "oem_encode") else "utf-8"
"""The encoding of batch files, and of what `for /f` reads from a program."""

_LONGEST_WORKING_FOLDER = 258
"""Even if longer paths are switched on."""

_OPEN_ELSEWHERE_S = 2.0
"""Virus scanners and indexers open new files for a moment."""
_AGAIN_S = 0.05

_CLOSING_EVENTS = (2, 5, 6)
"""CTRL_CLOSE_EVENT, CTRL_LOGOFF_EVENT and CTRL_SHUTDOWN_EVENT."""
_CLOSING_S = 5.0
_kept: list[object] = []
"""Functions that Windows may call as long as the process runs."""


def with_slashes(path: str) -> str:
    """Return a path with forward slashes, as in CMake and URLs. Elsewhere, a backslash is part of a name."""
    return path.replace("\\", "/") if ON_WINDOWS else path


def console_path(paths: str) -> str:
    r"""Return paths, with `;` between them, as batch files can contain them.

    A path with letters that the code page of cmd lacks becomes Windows's short name for it, as in `C:\BRA~1`.

    Raises:
        OSError: it has no short name.
    """
    return ";".join(map(_in_the_code_page, paths.split(";")))


def _in_the_code_page(path: str) -> str:
    try:
        path.encode(CONSOLE_ENCODING)
    except UnicodeEncodeError:
        import ctypes

        short = ctypes.create_unicode_buffer(32768)
        getattr(ctypes, "windll").kernel32.GetShortPathNameW(path, short, len(short))  # noqa: B009 # mypy
        if not short.value or not short.value.isascii():
            why = "cmd's code page lacks letters of this path: use PowerShell, or another folder"
            raise OSError(errno.EILSEQ, why, path) from None
        return short.value
    return path


def check_working_folder(folder: str) -> None:
    """Check that a program can be started in a folder.

    Raises:
        OSError: the folder's path is too long for Windows, which then names no reason.
    """
    if ON_WINDOWS and len(folder) > _LONGEST_WORKING_FOLDER:
        reason = (
            f"Windows starts no program in a folder whose path has over {_LONGEST_WORKING_FOLDER} characters"
        )
        raise OSError(errno.ENAMETOOLONG, reason, folder)


def relative_path(path: str, folder: str) -> str:
    """Return a path relative to a folder. A path on another drive of Windows is returned as it is."""
    try:
        return os.path.relpath(path, folder)
    except ValueError:
        return path


def is_as_written(path: str) -> bool:
    """Return whether an existing file or folder has a name in this case. Windows finds it in any case."""
    folder, name = os.path.split(path)
    return not ON_WINDOWS or name in os.listdir(folder)


def file_url(path: str) -> str:
    """Return a path as `file:///C:/folder` or `file:////server/share`; elsewhere, `file:///folder`.

    Nothing is escaped.
    """
    return f"file://{'/' if ON_WINDOWS and path[1:2] == ':' else ''}{with_slashes(path)}"


def path_of_url(url: str) -> str:
    """Return the path that a `file://` URL names, as it is written there.

    On Windows, a host in it is a server, as in `file://server/share`, which is how Python writes it.
    """
    path = url[len("file://") :]
    if not ON_WINDOWS:
        return path
    if path[2:3] == ":":
        return path[1:]
    return path if path.startswith("/") or path[1:2] == ":" else f"//{path}"


def replace_file(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    sleep: Callable[[float], object] = time.sleep,
) -> None:
    """Rename a file, replacing the target, which may be read-only.

    On Windows, wait up to 2 s for programs that have a file open.

    Raises:
        OSError: the file cannot be renamed.
    """
    for _ in range(round(_OPEN_ELSEWHERE_S / _AGAIN_S) if ON_WINDOWS else 0):
        try:
            os.replace(source, target)
        except PermissionError:
            _make_writable(target)
            sleep(_AGAIN_S)
        else:
            return
    os.replace(source, target)


def remove_file(path: str | os.PathLike[str]) -> None:
    """Remove a file or link if it exists, even if it is read-only."""
    _make_writable(path)
    try:
        os.unlink(path)
    except FileNotFoundError:
        return


def _make_writable(path: str | os.PathLike[str]) -> None:
    """Clear the mark of a read-only file, which Windows would neither replace nor remove."""
    try:
        if ON_WINDOWS and not os.lstat(path).st_mode & stat.S_IWRITE:
            os.chmod(path, stat.S_IWRITE)
    except OSError:
        return


def call_when_console_closes(act: Callable[[], object]) -> None:
    """Call a function in another thread when the console's window is closed, or its user logs off.

    Windows ends the process five seconds later; without this, at once. Do nothing on other systems.
    """
    if sys.platform == "win32":
        import ctypes

        def on_event(event: int) -> int:
            if event not in _CLOSING_EVENTS:
                return 0  # Ctrl-C and Ctrl-Break, which Python handles
            act()
            time.sleep(_CLOSING_S)
            return 1

        handle = ctypes.WINFUNCTYPE(ctypes.c_int, ctypes.c_uint)(on_event)
        if ctypes.windll.kernel32.SetConsoleCtrlHandler(handle, 1):
            _kept.append(handle)


def registry_values(key: str) -> dict[str, str]:
    r"""Return the texts and numbers of a key in the registry, such as `HKEY_CURRENT_USER\Environment`.

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
                    if isinstance(value, (str, int)):
                        found[name] = str(value)
        except OSError:
            return found
    return found
