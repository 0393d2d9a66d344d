"""Syntax of message type names.

This module is separate from the parser, because loading a message class always needs `is_full_type_name`, but
rarely the parser.
"""

from __future__ import annotations

import re

_FULL_TYPE = re.compile(r"[A-Za-z]\w*/[A-Za-z]\w*", re.ASCII)


def is_full_type_name(type_name: str) -> bool:
    """Return True for a name of the form `package/Name`."""
    return _FULL_TYPE.fullmatch(type_name) is not None
