"""The language of ROS 2's definitions, and the places where definitions are found."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.language.parse import parse_message
from pipros.msg.language.spec import DefinitionError
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog
from pipros_rosbag2.interfaces.derive import derived_message
from pipros_rosbag2.interfaces.installed import folders_of_environment, installed_definitions
from pipros_rosbag2.interfaces.parse import messages_from_text, parse_ros2_message, parse_ros2_service
from pipros_rosbag2.interfaces.ros1_text import ros1_definition
from pipros_rosbag2.interfaces.spec import NO_FIELDS, Form, Ros2Constant, Ros2Field, Ros2Type


def test_fields_have_bounds_and_defaults() -> None:
    text = """
    # A comment
    int8 MOST=3   # behind
    string NAME="a # b"
    Inner[<=4] inner
    std_msgs/Header header
    string<=10[] words
    float64[3] x [1.0, 2.0, 3.0]
    string s 'it # is'   # a comment
    wstring w
    """

    message = parse_ros2_message(text, "my_pkg/msg/Outer")

    assert message.constants == (Ros2Constant("int8", "MOST", "3"), Ros2Constant("string", "NAME", '"a # b"'))
    assert message.fields == (
        Ros2Field(Ros2Type("my_pkg/msg/Inner", Form.BOUNDED, 4), "inner"),
        Ros2Field(Ros2Type("std_msgs/msg/Header"), "header"),
        Ros2Field(Ros2Type("string", Form.SEQUENCE, 0, 10), "words"),
        Ros2Field(Ros2Type("float64", Form.ARRAY, 3), "x", "[1.0, 2.0, 3.0]"),
        Ros2Field(Ros2Type("string"), "s", "'it # is'"),
        Ros2Field(Ros2Type("wstring"), "w"),
    )
    assert parse_ros2_message(message.text(), message.type) == message


def test_a_definition_without_fields_has_one_byte() -> None:
    assert parse_ros2_message("int8 X=1", "a/msg/B").fields == (NO_FIELDS,)
    assert parse_ros2_message("", "a/msg/B").text() == ""


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("int32", "a field name must begin with a letter"),
        ("int32[0] x", "the length must be at least 1"),
        ("int32[<=99999999999] x", "is not a type"),
        ("int32[999999999] x", "a length or bound must be at most"),
        ("int32<=4 x", "only strings have a maximum length"),
        ("a/b/c/d x", "is not a type"),
        ("int32 9x", "a field name must begin with a letter"),
        ("int32 x\nint8 x", "x is declared twice"),
    ],
)
def test_invalid_declarations_raise(line: str, reason: str) -> None:
    with pytest.raises(DefinitionError, match=reason):
        parse_ros2_message(line, "a/msg/B", "B.msg")


def test_a_service_has_two_halves() -> None:
    service = parse_ros2_service("int64 a\n---\nint64 sum", "my_pkg/srv/Add")

    assert (service.request.type, service.response.type) == (
        "my_pkg/srv/Add_Request",
        "my_pkg/srv/Add_Response",
    )
    assert [field.name for field in service.response.fields] == ["sum"]
    with pytest.raises(
        DefinitionError, match="the parts request, response, separated by --- lines, got 1 of them"
    ):
        parse_ros2_service("int64 a", "my_pkg/srv/Add")


def test_the_text_of_a_bag_holds_all_types() -> None:
    separator = "=" * 80
    text = f"a_msgs/Inner x\n{separator}\nMSG: a_msgs/Inner\nint32 y\n"

    found = messages_from_text("a_msgs/msg/Outer", text)

    assert list(found) == ["a_msgs/msg/Outer", "a_msgs/msg/Inner"]
    with pytest.raises(DefinitionError, match="expected MSG"):
        messages_from_text("a_msgs/msg/Outer", f"int32 x\n{separator}\nint32 y")


def test_a_type_of_ros2_has_a_definition_in_ros1() -> None:
    text = """
    uint8 HEX=0x1f
    bool ON=true
    string<=9 NAME="a b"
    std_msgs/Header header
    builtin_interfaces/Time[<=3] stamps
    builtin_interfaces/Duration[2] waits
    Inner inner
    string<=5 word "x"
    """

    spec = ros1_definition(parse_ros2_message(text, "my_msgs/msg/Mine"))

    assert spec.type == "my_msgs/Mine"
    assert spec.text == (
        "uint8 HEX=31\nbool ON=True\nstring NAME=a b\nHeader header\ntime[] stamps\nduration[2] waits\n"
        "my_msgs/Inner inner\nstring word\n"
    )
    assert ros1_definition(parse_ros2_message("", "a/msg/B")).fields == ()
    with pytest.raises(DefinitionError, match="ROS 1 has no wide strings: w"):
        ros1_definition(parse_ros2_message("wstring w", "a/msg/B"))


def test_constants_of_ros1_keep_their_values() -> None:
    spec = parse_message('string QUOTED=say "hi"\nbool ON=True\nint8 LOW=-5\nint8 x', "a/B")

    made = derived_message(spec)

    assert made.text() == 'string QUOTED="say \\"hi\\""\nbool ON=true\nint8 LOW=-5\nint8 x\n'


def test_folders_precede_carried_types(tmp_path: Path) -> None:
    for package, name in (("my_msgs", "Mine"), ("sensor_msgs", "Range")):
        folder = tmp_path / package / "msg"
        folder.mkdir(parents=True)
        (folder / f"{name}.msg").write_text("float32 only")
    catalog = Catalog(Distribution.JAZZY, installed_definitions(), [tmp_path])

    assert [each.name for each in catalog.message("my_msgs/msg/Mine").fields] == ["only"]
    assert [each.name for each in catalog.message("sensor_msgs/msg/Range").fields] == ["only"]
    assert catalog.has_message("std_msgs/msg/String")
    assert not catalog.has_service("my_msgs/srv/Mine")


def test_an_unknown_type_names_the_folders_that_were_searched(tmp_path: Path) -> None:
    catalog = Catalog(Distribution.HUMBLE, installed_definitions(), [tmp_path])

    with pytest.raises(NotFound, match=rf"my_msgs/msg/Mine is unknown in ROS 2 humble.*{tmp_path}"):
        catalog.message("my_msgs/msg/Mine")


def test_types_can_be_derived_from_ros1() -> None:
    strict = Catalog(Distribution.JAZZY, installed_definitions())
    lenient = Catalog(Distribution.JAZZY, installed_definitions(), derive=True)

    assert not strict.has_message("turtlesim/msg/Pose")
    assert lenient.message("turtlesim/msg/Pose").text() == (
        "float32 x\nfloat32 y\nfloat32 theta\nfloat32 linear_velocity\nfloat32 angular_velocity\n"
    )
    assert not lenient.has_message("std_msgs/msg/Time")  # ROS 2 has removed it


def test_lyrical_lacks_what_it_removed() -> None:
    for distribution in Distribution:
        catalog = Catalog(distribution, installed_definitions(), derive=True)
        is_there = distribution is not Distribution.LYRICAL
        assert catalog.has_message("geometry_msgs/msg/Pose2D") is is_there


def test_the_environment_names_folders() -> None:
    environment = {"AMENT_PREFIX_PATH": "/opt/ros/jazzy:/home/me/install/mine"}

    assert [str(each) for each in folders_of_environment(environment)] == [
        "/opt/ros/jazzy/share",
        "/home/me/install/mine/share",
    ]
    assert folders_of_environment({}) == []
