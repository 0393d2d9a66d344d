"""Open a page in the desktop's browser, if there is a desktop."""

from __future__ import annotations

import asyncio
import os
import sys
import threading
import webbrowser
from collections.abc import Callable
from typing import Final

from pipros.server.access import Access
from pipros.server.opening_file import OpeningFile
from pipros.server.secret import CODE_S

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
