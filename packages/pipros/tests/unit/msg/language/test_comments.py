"""The elements of a definition to which its comments belong."""

from __future__ import annotations

import pytest

from pipros.msg.language.comments import comments_of
from pipros.msg.language.parse import parse_action


def test_a_comment_belongs_to_the_declaration_on_its_line_and_directly_below() -> None:
    text = "# Head.\n\nint32 A=1 # one\n# above,\n#  indented\nint32 b  ## behind\n\n# lost\n\nint32 c\n"

    found = comments_of(text)

    assert found.head == "Head."
    assert found.of == {"A": "one", "b": "above,\n indented\nbehind"}


@pytest.mark.parametrize(
    ("text", "head", "first"),
    [
        ("# Head.\nint32 x\n", "Head.", None),
        ("# Head.\nint32 x  # first\n", "Head.", "first"),
        ("# Head.\n# More.\n\n# Last.\n\nint32 x\n", "Head.\nMore.\n\nLast.", None),
        ("# Head.\n\n# first\nint32 x\n", "Head.", "first"),
        ("#####\n# Head.\n#####\nint32 x\n", "Head.", None),
        ("\n\nint32 x\n", "", None),
        ("# Nothing else.", "Nothing else.", None),
        ("", "", None),
    ],
)
def test_a_comment_at_the_top_belongs_to_the_whole_definition(
    text: str, head: str, first: str | None
) -> None:
    found = comments_of(text)
    assert (found.head, found.of.get("x")) == (head, first)


def test_the_value_of_a_string_constant_is_not_a_comment() -> None:
    assert comments_of("# Head.\n\n# name\nstring A=a # b\n").of == {"A": "name"}


def test_the_note_in_messages_of_an_action_is_not_a_comment() -> None:
    action = parse_action("# Head.\n\nint32 x  # goal\n---\n---\nint32 y\n", "robot/Go")
    assert [comments_of(message.text).head for message in action.messages] == ["Head.", *[""] * 6]
