"""The definition files of packages on disk."""

from __future__ import annotations

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.language.spec import DefinitionError
from tests.support.definitions import Packages


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
