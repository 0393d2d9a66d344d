"""Display a message in a notebook: a table of its fields and, for images and similar messages, a picture."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator
from itertools import islice
from typing import Any, Final

from pipros.basics.html_table import html_table
from pipros.msg.time import TVal

ELEMENTS: Final = 10
"""Maximum number of an array's elements that are shown."""
ROWS: Final = 200
"""Maximum number of rows that are shown."""
_PIXELS, _BYTES = 64 * 1024 * 1024, 1 << 20


def message_html(message: Any) -> str:
    """Return HTML that shows a message. Text in the message is escaped."""
    rows = list(islice(_rows(message, ""), ROWS + 1))
    if len(rows) > ROWS:
        rows[ROWS:] = [("…", "")]
    return _picture(message) + html_table(("field", "value"), rows, message._type)


def _rows(value: Any, path: str) -> Iterator[tuple[str, object]]:
    if isinstance(value, bytes | bytearray | memoryview):
        yield path, f"{len(value)} bytes"
    elif hasattr(value, "_slot_types") and not isinstance(value, TVal):
        for name in value.__slots__:
            yield from _rows(getattr(value, name), f"{path}.{name}" if path else name)
    elif not isinstance(value, str) and hasattr(value, "__len__"):
        first = list(islice(value, ELEMENTS))
        if first and hasattr(first[0], "_slot_types"):
            for number, each in enumerate(first):
                yield from _rows(each, f"{path}[{number}]")
            if len(value) > ELEMENTS:
                yield path, f"… {len(value)} elements"
        else:
            more = f", … {len(value)} elements" if len(value) > ELEMENTS else ""
            yield path, f"[{', '.join(map(str, first))}{more}]"
    elif isinstance(value, TVal):
        yield path, f"{value.secs}.{value.nsecs:09d}"
    else:
        yield path, value


def _picture(message: Any) -> str:
    """Return an HTML image of a message.

    Return an empty string if the message cannot be drawn, or Pillow is not installed.
    """
    try:
        from pipros_libraries.pictures.drawn import picture_of
        from pipros_libraries.pictures.errors import PictureError
    except ImportError:
        return ""
    try:
        picture, note, _ = picture_of(message, _PIXELS, _BYTES)
    except PictureError:
        return ""
    data = b64encode(picture.content).decode("ascii")
    source = f"data:{picture.kind};base64,{data}"
    return f'<img src="{source}" title="{note}" style="max-width: 100%; max-height: 24em"/>'
