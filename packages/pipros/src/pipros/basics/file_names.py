"""Check file names that peers choose."""

from __future__ import annotations

import re

_DEVICE = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[0-9¹²³])\s*(\..*)?", re.IGNORECASE)


def is_device(name: str) -> bool:
    """Return whether Windows treats a file with this name as a device. The extension does not matter.

    >>> [is_device(name) for name in ("CON", "nul.json", "com1 .bag", "console", "com10")]
    [True, True, True, False, False]
    """
    return _DEVICE.fullmatch(name) is not None
