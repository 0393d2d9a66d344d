"""A private file that redirects a browser to an address that other users must not see.

Every user can read command lines, so they must not contain an address with a code. Instead, they name a file
of mode 0600 in a folder of mode 0700, which contains the address. Browsers from a snap or a Flatpak can read
neither the system's temporary folder nor hidden folders below HOME. A snap may read the other folders below
HOME, and a Flatpak the folder for downloads, so the file is created in one of these folders if possible.
"""

from __future__ import annotations

import atexit
import html
import json
import os
import re
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

_NAME = "pipros-page-"
_SETTINGS_BYTES = 64 * 1024
_DOWNLOADS = re.compile(r'(?m)^\s*XDG_DOWNLOAD_DIR="\$HOME/([^"]*)"')


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
        with config.open("rb") as file:
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
