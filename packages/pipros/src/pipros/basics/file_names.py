"""Check file names that peers choose, and make them differ."""

from __future__ import annotations

import re

from pipros.basics.windows import ON_WINDOWS

# Not compiled on import: every node imports this module.
_DEVICE = r"(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[0-9¹²³])\s*(\..*)?"


def is_device(name: str) -> bool:
    """Return whether Windows treats a file with this name as a device. The extension does not matter.

    >>> [is_device(name) for name in ("CON", "nul.json", "com1 .bag", "console", "com10")]
    [True, True, True, False, False]
    """
    return re.fullmatch(_DEVICE, name, re.IGNORECASE) is not None


def file_stem(name: str) -> str:
    """Return a name for a file that a node, a topic or a robot names. On Windows, `_` follows a device's."""
    return f"{name}_" if ON_WINDOWS and is_device(name) else name


def distinct_name(base: str, taken: dict[str, int]) -> str:
    """Return `base`, with a number after it if a name in `taken` differs at most in case. Add it to `taken`.

    >>> names: dict[str, int] = {}
    >>> [distinct_name(each, names) for each in ("a__b", "A__b", "a__b")]
    ['a__b', 'A__b_2', 'a__b_3']
    """
    name = base
    while name.lower() in taken:
        taken[base.lower()] += 1
        name = f"{base}_{taken[base.lower()]}"
    taken[name.lower()] = 1
    return name
