"""Open a page in the desktop's browser, if there is a desktop.

Every user can read command lines, so they must not contain an address with a code. Instead, they name a file
of mode 0600 in a folder of mode 0700, which contains the address. Browsers from a snap or a Flatpak can read
neither the system's temporary folder nor hidden folders below HOME. A snap may read the other folders below
HOME, and a Flatpak the folder for downloads, so the file is created in one of these folders if possible.
"""

from __future__ import annotations

import asyncio
import atexit
import html
import json
import os
import re
import shutil
import sys
import tempfile
import threading
import webbrowser
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from pipros.basics.input_file import open_file
from pipros_server.access import Access
from pipros_server.secret import CODE_S

VARIABLE: Final = "PIPROS_BROWSER"
"""If this variable is `off`, programs print addresses without opening them."""

USED_WITHIN_S: Final = 5.0
"""If the browser has not used its code within this time, the address is printed."""


def open_in_browser(
    access: Access,
    host: str,
    tab: str = "",
    *,
    later: Callable[[float, Callable[[], None]], object] | None = None,
) -> None:
    """Open the page in a browser if there is a display. Does not wait for the browser.

    The browser's command line, which other users can read, names only a private file. Call this function in
    the event loop of the page's server.

    Args:
        later: calls a function after a time in seconds; defaults to the running event loop's `call_later`.
    """
    if not _has_display() or os.environ.get(VARIABLE) == "off":
        return
    code = access.secret.new_code()
    again = f"the browser did not open the page; paste this address into one: {access.url(host, tab)}"
    try:
        file = OpeningFile(access.url_with_code(host, code, tab))
    except OSError as error:
        print(f"{again} ({error.strerror})", file=sys.stderr, flush=True)
        return
    later = later or asyncio.get_running_loop().call_later

    def check() -> None:
        if access.secret.is_unused(code):
            print(again, file=sys.stderr, flush=True)
        else:
            file.remove()

    later(USED_WITHIN_S, check)
    later(CODE_S, file.remove)
    threading.Thread(target=webbrowser.open, args=(file.uri,), daemon=True).start()


def _has_display() -> bool:
    if sys.platform in ("darwin", "win32"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


_NAME = "pipros-page-"
_SETTINGS_BYTES = 64 * 1024
_DOWNLOADS = re.compile(r'(?m)^[ \t]*XDG_DOWNLOAD_DIR="\$HOME/([^"]*)"')


class OpeningFile:
    """The file. It exists until `remove` is called or the interpreter exits.

    Attributes:
        path: the file.
    """

    def __init__(self, address: str, variables: Mapping[str, str] = os.environ) -> None:
        """Write the file.

        Raises:
            OSError: the file cannot be created.
        """
        self._folder = _new_folder(variables)
        self.path = self._folder / "open.html"
        atexit.register(self.remove)
        descriptor = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with open(descriptor, "w", encoding="utf-8") as file:
            file.write(_page(address))

    @property
    def uri(self) -> str:
        return self.path.as_uri()

    def remove(self) -> None:
        """Remove the file and its folder. May be called repeatedly."""
        shutil.rmtree(self._folder, ignore_errors=True)
        atexit.unregister(self.remove)


def folders_for_browsers(variables: Mapping[str, str]) -> list[Path]:
    """Return the existing folders that a confined browser can read, best first."""
    home = variables.get("HOME") or variables.get("USERPROFILE")
    if not home:
        return []
    config = Path(variables.get("XDG_CONFIG_HOME") or Path(home, ".config"), "user-dirs.dirs")
    downloads = ["Downloads"]
    try:
        with open_file(config) as file:
            named = _DOWNLOADS.search(file.read(_SETTINGS_BYTES).decode("utf-8", "replace"))
        downloads = [named[1], *downloads] if named else downloads
    except OSError:
        pass
    folders = [Path(home, name) for name in downloads if name] + [Path(home)]
    return [folder for folder in folders if folder.is_dir()]


def _new_folder(variables: Mapping[str, str]) -> Path:
    for folder in folders_for_browsers(variables):
        try:
            return Path(tempfile.mkdtemp(prefix=_NAME, dir=folder))  # `mkdtemp` sets the mode 0700
        except OSError:
            continue
    return Path(tempfile.mkdtemp(prefix=_NAME))


def _page(address: str) -> str:
    quoted = html.escape(address)
    in_script = json.dumps(address).replace("<", "\\u003c")
    return (
        '<!DOCTYPE html><meta charset="utf-8"><title>pipros</title>'
        '<meta name="referrer" content="no-referrer">'
        f"<script>location.replace({in_script})</script>"
        f'<noscript><meta http-equiv="refresh" content="0; url={quoted}"></noscript>'
        f'<p><a href="{quoted}">Open the page</a></p>\n'
    )
