"""The definition files of packages on disk."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros.errors import NotFound
from pipros.msg.definitions import Definitions
from pipros.msg.files import DefinitionFiles
from pipros.msg.spec import DefinitionError


class Packages:
    """Packages of definitions in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.definitions = Definitions(DefinitionFiles(self.find))

    def write(self, path: str, text: str | bytes) -> Path:
        file = self.folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(text.encode() if isinstance(text, str) else text)
        return file

    def find(self, name: str) -> Path | None:
        return self.folder / name if (self.folder / name).is_dir() else None


@pytest.fixture
def packages(tmp_path: Path) -> Packages:
    return Packages(tmp_path)


def test_names_are_those_of_files_and_of_what_actions_stand_for(packages: Packages) -> None:
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


def test_what_is_missing_is_said_with_where_it_was_looked_for(packages: Packages) -> None:
    packages.write("robot/msg/Arm.msg", "")
    with pytest.raises(
        NotFound, match=r"there is no message Leg in package robot: looked for .*/robot/msg/Leg\.msg"
    ):
        packages.definitions.message("robot/Leg")
    with pytest.raises(NotFound, match="there is no package cat: ROS_PACKAGE_PATH is not set"):
        packages.definitions.message("cat/Paw")


def test_what_is_no_text_is_a_mistake_in_the_file(packages: Packages) -> None:
    file = packages.write("robot/msg/Arm.msg", b"int32 \xff")
    with pytest.raises(DefinitionError, match=r"Arm\.msg: cannot be read") as caught:
        packages.definitions.message("robot/Arm")
    assert caught.value.file == str(file)


def test_all_mistakes_of_a_package_can_be_had_at_once(packages: Packages) -> None:
    packages.write("robot/msg/Good.msg", "int32 x")
    packages.write("robot/msg/Two.msg", "int32\nint32 x\nint32 a b c")
    packages.write("robot/msg/Lost.msg", "No_such x")
    packages.write("robot/msg/Circle.msg", "Circle x")
    packages.write("robot/msg/Uses.msg", "Two two")
    packages.write("robot/action/Do.action", "int32 x")

    found = [
        str(mistake).removeprefix(f"{packages.folder}/robot/")
        for mistake in packages.definitions.mistakes("robot")
    ]

    assert [text.partition(": ")[0] for text in found] == [
        *("msg/Circle.msg:1:1", "action/Do.action", "msg/Lost.msg:1:1", "msg/Two.msg:1:1", "msg/Two.msg:3:1"),
    ]
