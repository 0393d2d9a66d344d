"""Convert messages and their parts to values for answers. Performs no I/O."""

from __future__ import annotations

from typing import Any, Final

from pipros.assistants.answer import ToolRefused
from pipros.basics.errors import PiprosError
from pipros.graph.message_path import PathStep, extract, parse_path
from pipros.graph.message_tree import message_tree

ROW_VALUES: Final = 500
"""Maximum number of values of a message in an answer that contains only this message."""


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
