"""`catkin.tidy_xml`: replaces characters that are forbidden in XML."""

from __future__ import annotations

import re
from pathlib import Path

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "codecs os")

char = chr

RE_XML_ILLEGAL = (
    "([\x00-\x08\x0b-\x0c\x0e-\x1f\ufffe-\uffff])"
    "|([\ud800-\udbff][^\udc00-\udfff])|([^\ud800-\udbff][\udc00-\udfff])"
    "|([\ud800-\udbff]$)|(^[\udc00-\udfff])"
)
"""Pattern that matches the characters that XML does not allow."""

_ILLEGAL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")


def tidy_xml(filename: str) -> bool:
    """Replace each character forbidden in XML with a question mark. Return True.

    Raises:
        ValueError: the file does not exist.
        OSError: the file cannot be read or written.
    """
    file = Path(filename)
    if not file.is_file():
        raise ValueError("file does not exist")
    text = file.read_bytes().decode("utf-8", "replace")
    tidy = _ILLEGAL.sub("?", text)
    if tidy != text:
        file.write_bytes(tidy.encode("utf-8"))
    return True
