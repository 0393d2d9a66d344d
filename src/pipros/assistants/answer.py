"""The answers of tools, as text of limited size.

An answer is one JSON object in one line. Everything that comes from the robot or from a file, names included,
stands in the field `data`, which is the last one. All other fields have fixed texts or numbers. Strings in
`data` cannot end it, because JSON escapes quotes, and control characters have been replaced before.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.hidden_text import safe

if TYPE_CHECKING:
    from pipros.pictures.drawn import EncodedPicture

FRAME_BYTES: Final = 1000
"""Room for all fields except `data`."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The result of a tool.

    Attributes:
        data: rows with values of the robot.
        note: what the rows mean, or how they were chosen; a text of this program, without values.
        figures: numbers for fields beside `data`.
        pictures: pictures.
        begin: the number of the first of `data` among all rows, if the tool has skipped the earlier ones.
        has_more: whether there are rows after those in `data`.
    """

    data: Sequence[Any]
    note: str = ""
    figures: Mapping[str, float | None] = field(default_factory=dict)
    pictures: Sequence[EncodedPicture] = ()
    begin: int | None = None
    has_more: bool = False


class ToolRefused(PiprosError):
    """A tool cannot answer.

    Attributes:
        rule: why, as a text without values.
        value: the value that breaks the rule, which may come from the robot.
    """

    def __init__(self, rule: str, value: object = None) -> None:
        self.rule = rule
        self.value = value
        super().__init__(rule)


def answer_text(answer: Answer, cursor: int, limit_bytes: int) -> str:
    """Return the rows from number `cursor` on that fit, with the cursor for the others in `next`.

    A row that is too large by itself is replaced by its size.
    """
    begin = cursor if answer.begin is None else answer.begin
    rows = answer.data[cursor:] if answer.begin is None else answer.data
    left = limit_bytes - FRAME_BYTES
    texts: list[str] = []
    for row in rows:
        text = _json(safe(row))
        size = len(text.encode())
        if size > limit_bytes - FRAME_BYTES:
            text = _json({"left_out_bytes": size})
            size = len(text)
        if size + 1 > left:
            break
        texts.append(text)
        left -= size + 1
    is_cut = len(texts) < len(rows) or answer.has_more
    fields: dict[str, Any] = {"note": answer.note} if answer.note else {}
    fields |= {name: safe(value) for name, value in answer.figures.items()}
    if is_cut:
        fields["next"] = begin + len(texts)
    return f'{_json(fields)[:-1]}{", " if fields else ""}"data": [{",".join(texts)}]}}'


def error_text(rule: str, value: object = None) -> str:
    """Return the text of an error: the rule, and in `data` the value that breaks it."""
    fields = {"error": rule}
    return _json(fields if value is None else {**fields, "data": safe(value)})


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, separators=(",", ": "), allow_nan=False)
