"""Tables in HTML, for the displays of notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any, Final

CELL: Final = 200
"""Maximum number of characters of a cell."""


def html_table(head: Sequence[str], rows: Iterable[Sequence[Any]], caption: str = "") -> str:
    """Return a table. All texts are escaped, and cells are cut at `CELL` characters."""
    title = f"<caption>{cell(caption)}</caption>" if caption else ""
    names = "".join(f"<th>{cell(each)}</th>" for each in head)
    body = "".join(f"<tr>{''.join(f'<td>{cell(each)}</td>' for each in row)}</tr>" for row in rows)
    return f"<table>{title}<thead><tr>{names}</tr></thead><tbody>{body}</tbody></table>"


def cell(value: object) -> str:
    """Return a value as escaped text of at most `CELL` characters."""
    text = str(value)
    return escape(text if len(text) <= CELL else f"{text[:CELL]}…")
