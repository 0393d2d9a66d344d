"""What names of message types look like: every load of a class needs that, few need the parser."""

from __future__ import annotations

import re

_FULL_TYPE = re.compile(r"[A-Za-z]\w*/[A-Za-z]\w*", re.ASCII)


def is_full_type_name(type_name: str) -> bool:
    """True for `package/Name`."""
    return _FULL_TYPE.fullmatch(type_name) is not None
