"""HTML tables for display in notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any, Final

CELL: Final = 200
"""Maximum number of characters in a cell."""
_LEFT: Final = 'style="text-align: left"'


def html_table(head: Sequence[str], rows: Iterable[Sequence[Any]], caption: str = "") -> str:
    """Return an HTML table. Its caption and first column are left-aligned, unlike notebooks' default.

    All text is escaped, and cells are truncated to `CELL` characters.
    """
    title = f"<caption {_LEFT}>{cell(caption)}</caption>" if caption else ""
    top = _row("th", head)
    body = "".join(_row("td", each) for each in rows)
    return f"<table>{title}<thead>{top}</thead><tbody>{body}</tbody></table>"


def _row(kind: str, values: Sequence[Any]) -> str:
    cells = (f"<{kind}{f' {_LEFT}' * (not at)}>{cell(each)}</{kind}>" for at, each in enumerate(values))
    return f"<tr>{''.join(cells)}</tr>"


def cell(value: object) -> str:
    """Return a value as escaped text, truncated to `CELL` characters."""
    text = str(value)
    return escape(text if len(text) <= CELL else f"{text[:CELL]}…")
