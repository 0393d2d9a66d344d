"""The answers of tools, as text of limited size.

An answer is a JSON object on one line. Everything that comes from the robot or from a file, including names,
is in the last field, `data`. All other fields contain fixed texts or numbers. A string in `data` cannot
pretend to be another field, because JSON escapes quotes, and control characters are replaced.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.hidden_text import safe
from pipros.basics.similar_names import near_names

if TYPE_CHECKING:
    from pipros_libraries.pictures.drawn import EncodedPicture

FRAME_BYTES: Final = 1000
"""Room for all fields except `data`."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The result of a tool.

    Attributes:
        data: rows with values from the robot.
        note: what the rows mean, or how they were chosen; a fixed text without values.
        figures: numbers to add as further fields.
        pictures: pictures to add to the answer.
        begin: the index of the first row in `data` among all rows; None if `data` contains all rows.
        has_more: whether more rows follow the rows in `data`.
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
        rule: the reason, as a fixed text without values.
        value: the value that violates the rule, which may come from the robot. An unknown name is followed by
            the `known` ones that are similar.
    """

    def __init__(self, rule: str, value: object = None, known: Iterable[str] = ()) -> None:
        near = near_names(str(value), known)
        self.rule = rule
        self.value = [value, *near] if near else value
        super().__init__(rule)


def answer_text(answer: Answer, cursor: int, limit_bytes: int) -> str:
    """Return an answer with as many rows as fit, starting at index `cursor`. If rows remain, add `next`.

    The field `next` is the cursor for the remaining rows. A row that is too large is replaced by its size.
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
    """Return the text of an error: the rule and, in `data`, the value that violates it."""
    fields = {"error": rule}
    return _json(fields if value is None else {**fields, "data": safe(value)})


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, separators=(",", ": "), allow_nan=False)
