"""Convert messages and their parts to values for answers. Performs no I/O."""

from __future__ import annotations

import json
import operator
import re
from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

from pipros.basics.errors import PiprosError
from pipros_assistants.answer import ToolRefused
from pipros_tools.graph.message_path import PathStep, extract, parse_path
from pipros_tools.graph.message_tree import message_tree

ROW_VALUES: Final = 500
"""Maximum number of values of a message in an answer that contains only this message."""


_OPERATORS: Final[dict[str, Callable[..., bool]]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<=": operator.le,
    ">=": operator.ge,
    "<": operator.lt,
    ">": operator.gt,
}
_CONDITION: Final = re.compile(
    r"\s*([\w./\[\]:-]+)\s*(==|!=|<=|>=|<|>)\s*('[^']*'|\"[^\"]*\"|[^\s'\"]+)\s*(?:and\b|$)"
)
"""A part of a message, an operator and a value; `and` joins conditions."""


class ValueCondition(NamedTuple):
    """A comparison of a part of a message with a number, a text, True or False."""

    steps: list[PathStep]
    compare: Callable[..., bool]
    value: object


def conditions_of(text: str) -> list[ValueCondition]:
    """Parse conditions such as `level >= 8 and name == 'door'`; an empty text has none.

    Raises:
        ToolRefused: the text is malformed.
    """
    found, at = [], 0
    while at < len(text.rstrip()):
        match = _CONDITION.match(text, at)
        if match is None:
            raise ToolRefused(
                "where must be PART OPERATOR VALUE, joined by and; the operators are == != < <= > >=",
                text[at:],
            )
        found.append(ValueCondition(steps_of(match[1]), _OPERATORS[match[2]], _value(match[3])))
        at = match.end()
    return found


def _value(text: str) -> object:
    if text[0] in "'\"":
        return text[1:-1]
    if text in ("True", "False"):
        return text == "True"
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text


def fulfils(message: object, conditions: Sequence[ValueCondition]) -> bool:
    """Return whether all conditions are true.

    Raises:
        ToolRefused: the message lacks a part, or a part cannot be compared with its value.
    """
    for steps, compare, value in conditions:
        part = part_of(message, steps)
        part = part.to_sec() if hasattr(part, "to_sec") else part
        is_number = isinstance(part, (int, float)) and isinstance(value, (int, float))
        if not is_number and not (isinstance(part, str) and isinstance(value, str)):
            raise ToolRefused(
                "where compares numbers with numbers, and texts with texts", [str(part)[:200], value]
            )
        if not compare(part, value):
            return False
    return True


def has_text(value: object, text: str) -> bool:
    """Return whether a text of a message contains `text`, which must be casefolded. It may be empty."""
    if not text:
        return True
    if isinstance(value, str):
        return text in value.casefold()
    if isinstance(value, (list, tuple)):
        return any(has_text(each, text) for each in value)
    names = getattr(value, "__slots__", ()) if hasattr(value, "_slot_types") else ()
    return any(has_text(getattr(value, each), text) for each in names)


def steps_of(part: str) -> list[PathStep]:
    """Parse the path of a part of a message: `pose.position.x`, `/pose/position/x` or `ranges[0:10]`.

    Raises:
        ToolRefused: the part has unbalanced brackets or an invalid index.
    """
    try:
        return parse_path(part.replace(".", "/"))
    except PiprosError as error:
        raise ToolRefused("the part of the message is malformed", str(error)) from None


def part_of(message: Any, steps: list[PathStep]) -> Any:
    """Return a part of a message.

    Raises:
        ToolRefused: the message lacks this part.
    """
    try:
        return extract(message, steps).value
    except (PiprosError, IndexError) as error:
        raise ToolRefused("the messages do not have this part", str(error)) from None


def shown(value: Any, count: int = 1) -> Any:
    """Convert a message's value for an answer with `count` such values. Long arrays are shortened."""
    return message_tree(value, max(ROW_VALUES // max(count, 1), 20))


def whole(value: Any) -> Any:
    """Convert a message for the human who must approve it. Nothing is shortened."""
    if hasattr(value, "_slot_types"):
        return {name: whole(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, (bytes, bytearray)):
        return value.hex(" ")
    return [whole(each) for each in value] if isinstance(value, (list, tuple)) else value
