"""The elements of a definition to which its comments belong."""

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.language.comments import comments_of
from pipros.msg.language.parse import parse_action
from pipros.msg.language.spec import DefinitionError
from tests.support.definitions import Packages


def test_a_comment_belongs_to_the_declaration_on_its_line_and_directly_below() -> None:
    text = "# Head.\n\nint32 A=1 # one\n# above,\n#  indented\nint32 b  ## behind\n\n# lost\n\nint32 c\n"

    found = comments_of(text)

    assert found.head == "Head."
    assert found.of == {"A": "one", "b": "above,\n indented\nbehind"}


@pytest.mark.parametrize(("text", "head", "first"), [
    ("# Head.\nint32 x\n", "Head.", None), ("# Head.\nint32 x  # first\n", "Head.", "first"),
    ("# Head.\n# More.\n\n# Last.\n\nint32 x\n", "Head.\nMore.\n\nLast.", None),
    ("# Head.\n\n# first\nint32 x\n", "Head.", "first"), ("#####\n# Head.\n#####\nint32 x\n", "Head.", None),
    ("\n\nint32 x\n", "", None), ("# Nothing else.", "Nothing else.", None), ("", "", None),
])  # fmt: skip
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


# The definition files of packages on disk.


def test_names_are_those_of_files_and_of_messages_of_actions(packages: Packages) -> None:
    packages.write("robot/msg/Arm.msg", "")
    packages.write("robot/msg/notes.txt", "")
    packages.write("robot/srv/Ask.srv", "---")
    packages.write("robot/action/Do.action", "---\n---")

    files = packages.definitions.files

    assert files.names("msg", "robot") == [
        *("Arm", "DoAction", "DoActionFeedback", "DoActionGoal", "DoActionResult", "DoFeedback", "DoGoal"),
        "DoResult",
    ]
    assert files.names("srv", "robot") == ["Ask"]


def test_the_messages_of_an_action_are_found_in_its_file(packages: Packages) -> None:
    packages.write("robot/action/Do.action", "int32 order\n---\n---\n")
    assert [field.name for field in packages.definitions.message("robot/DoGoal").fields] == ["order"]
    assert packages.definitions.message("robot/DoActionGoal").has_header


def test_an_action_whose_name_ends_like_one_of_its_messages(packages: Packages) -> None:
    packages.write("robot/action/SetGoal.action", "int32 order\n---\n---\n")
    assert [field.name for field in packages.definitions.message("robot/SetGoalGoal").fields] == ["order"]


def test_line_ends_of_other_systems_do_not_count(packages: Packages) -> None:
    packages.write("robot/msg/Arm.msg", b"int32 a\r\nint32 b")
    assert packages.definitions.message("robot/Arm").text == "int32 a\nint32 b"


def test_a_missing_definition_is_reported_with_the_searched_places(packages: Packages) -> None:
    packages.write("robot/msg/Arm.msg", "")
    with pytest.raises(
        NotFound, match=r"there is no message Leg in package robot: looked for .*/robot/msg/Leg\.msg"
    ):
        packages.definitions.message("robot/Leg")
    with pytest.raises(NotFound, match="there is no package cat: ROS_PACKAGE_PATH is not set"):
        packages.definitions.message("cat/Paw")


def test_bytes_that_are_not_text_are_a_mistake_in_the_file(packages: Packages) -> None:
    file = packages.write("robot/msg/Arm.msg", b"int32 \xff")
    with pytest.raises(DefinitionError, match=r"Arm\.msg: the file cannot be read") as caught:
        packages.definitions.message("robot/Arm")
    assert caught.value.file == str(file)


def test_a_folder_besides_msg_is_searched_last_and_must_be_unambiguous(packages: Packages) -> None:
    """As `add_message_files(DIRECTORY test/msg FILES Arm.msg)` allows."""
    packages.write("robot/test/msg/Arm.msg", "int32 a")
    packages.write("robot/test/srv/Ask.srv", "int32 b\n---")
    assert packages.definitions.message("robot/Arm").text == "int32 a"
    assert [field.name for field in packages.definitions.service("robot/Ask").request.fields] == ["b"]

    packages.write("robot/old/Leg.msg", "int32 a")
    packages.write("robot/new/Leg.msg", "int32 a")
    with pytest.raises(NotFound, match=r"more than one file defines the message robot/Leg: .*Leg\.msg, "):
        packages.definitions.message("robot/Leg")
    packages.write("robot/msg/Leg.msg", "int32 c")
    assert packages.definitions.message("robot/Leg").text == "int32 c"
