"""Open a page in the desktop's browser, if there is a desktop."""

from __future__ import annotations

import os
import sys
import threading
import webbrowser

from pipros.web.access import Access


def open_in_browser(access: Access, host: str, tab: str = "") -> None:
    """Open the page in a browser if there is a display. Does not wait for the browser."""
    if _has_display():
        # Other users can read the browser's command line, so it must not contain the token.
        once = access.one_time_url(host, tab)
        threading.Thread(target=webbrowser.open, args=(once,), daemon=True).start()


def _has_display() -> bool:
    if sys.platform in ("darwin", "win32"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
