"""The `.idl` files of genuine ROS 2: their types equal those of `.msg`, `.srv` and `.action` files."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog
from pipros_rosbag2.interfaces.idl import parse_idl
from pipros_rosbag2.interfaces.installed import installed_definitions
from pipros_rosbag2.interfaces.parse import parse_ros2_action, parse_ros2_message, parse_ros2_service
from pipros_rosbag2.interfaces.spec import Ros2Field, Ros2Message, Ros2Type
from pipros_rosbag2.interfaces.type_hash import message_hash
from tests.support.ros2_wheels import DISTROS, environment


def parsed(file: Path, name: str) -> list[Ros2Message]:
    text = file.read_text()
    if file.suffix == ".msg":
        return [parse_ros2_message(text, name)]
    if file.suffix == ".srv":
        service = parse_ros2_service(text, name)
        return [service.request, service.response]
    action = parse_ros2_action(text, name)
    return [action.goal, action.result, action.feedback]


def fields(message: Ros2Message) -> list[tuple[Ros2Type, str]]:
    """Return types and names; `char` of `.msg` files is `uint8` in IDL."""

    def kind(field: Ros2Field) -> Ros2Type:
        return replace(field.type, base="uint8") if field.type.base == "char" else field.type

    return [(kind(each), each.name) for each in message.fields]


@pytest.mark.parametrize("distro", DISTROS)
def test_types_in_idl_files_equal_those_in_other_files(distro: str) -> None:
    compared = 0
    for file in sorted((environment(distro) / "share").glob("*/*/*.idl")):
        package, kind = file.parts[-3:-1]
        source = file.with_suffix(f".{kind}")
        found = parse_idl(file.read_text(), str(file))
        for message in parsed(source, f"{package}/{kind}/{file.stem}") if source.exists() else ():
            compared += 1
            assert fields(found[message.type]) == fields(message), file
            assert [each.name for each in found[message.type].constants] == [
                each.name for each in message.constants
            ]
    assert compared > 180


def test_types_that_exist_only_as_idl_have_the_hashes_of_ros2() -> None:
    share = environment("kilted") / "share"
    catalog = Catalog(Distribution.KILTED, installed_definitions(), [share])
    names = [file.stem for file in share.glob("test_msgs/msg/*.idl") if not file.with_suffix(".msg").exists()]
    assert len(names) == 4
    for name in names:
        hashes = json.loads((share / "test_msgs" / "msg" / f"{name}.json").read_text())["type_hashes"]
        expected = {each["type_name"]: each["hash_string"] for each in hashes}
        made = catalog.message(f"test_msgs/msg/{name}")
        assert message_hash(made, catalog.message) == expected[made.type]
