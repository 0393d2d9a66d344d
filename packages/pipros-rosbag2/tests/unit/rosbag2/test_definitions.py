"""The language of ROS 2's definitions, and the places where definitions are found."""

import contextlib
import time
from pathlib import Path

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.importing.hook import installed_library
from pipros.msg.language.definition_files import DefinitionFiles
from pipros.msg.language.definitions import Definitions
from pipros.msg.language.parse import parse_message
from pipros.msg.language.spec import DefinitionError
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog
from pipros_rosbag2.interfaces.derive import derived_message
from pipros_rosbag2.interfaces.idl import parse_idl
from pipros_rosbag2.interfaces.installed import folders_of_environment, installed_definitions
from pipros_rosbag2.interfaces.package import Ros2Package, ros2_package
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


@pytest.mark.parametrize(("line", "reason"), [
    ("int32", "a field name must begin with a letter"), ("int32[0] x", "the length must be at least 1"),
    ("int32[<=99999999999] x", "is not a type"), ("int32[999999999] x", "a length or bound must be at most"),
    ("int32<=4 x", "only strings have a maximum length"), ("a/b/c/d x", "is not a type"),
    ("int32 9x", "a field name must begin with a letter"), ("int32 x\nint8 x", "x is declared twice"),
])  # fmt: skip
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


# Types that exist only as `.idl` files.


STATUS = """
#include "std_msgs/msg/Header.idl"
/* A comment with a "quote and a struct { */
module demo { module msg {
  typedef float Matrix[9];
  module Status_Constants {
    const uint8 LOW = 1;  // not "HIGH"
    const string NAME = "a // b" "c";
    const boolean ON = TRUE;
  };
  @verbatim (language="comment", text="a (b)" "c")
  struct Status {
    @key std_msgs::msg::Header header;
    @default (value=-1.5e-3) @unit (value="m")
    double distance, offset;
    unsigned long long count;
    string<5> word;
    sequence<sequence_of_demo::msg::Part, 3> parts;
    @default (value="(1, 2)")
    sequence<octet> bytes;
    Matrix matrix;
    wstring names[2];
  };
}; };
"""


def test_structures_have_the_fields_and_constants_of_msg_files() -> None:
    found = parse_idl(STATUS, "Status.idl")

    assert list(found) == ["demo/msg/Status"]
    assert found["demo/msg/Status"].text() == (
        'uint8 LOW=1\nstring NAME="a // bc"\nbool ON=true\n'
        "std_msgs/Header header\nfloat64 distance -1.5e-3\nfloat64 offset -1.5e-3\nuint64 count\n"
        "string<=5 word\nsequence_of_demo/Part[<=3] parts\nbyte[] bytes [1, 2]\nfloat32[9] matrix\n"
        "wstring[2] names\n"
    )


@pytest.mark.parametrize(("text", "reason"), [
    ("module a { struct B { wchar c; }; };", r"\[wchar\] is not a type that ROS 1 can express"),
    ("module a { enum B { C }; };", r"expected a definition, got \[enum\]"),
    ("module a { struct B { int8 x[0]; }; };", "a length must be a number from 1"),
    ("module a { struct B { int8 x", "the file ends within a definition"),
    ("module a { struct B { sequence<sequence<int8>> x; }; };", "arrays of arrays"),
    ("module a { struct B { int8 x = 1; }; };", r"expected ; after x, got \[=\]"),
    ("module 3 { };", r"expected a name, got \[3\]"),
])  # fmt: skip
def test_other_definitions_are_refused(text: str, reason: str) -> None:
    with pytest.raises(DefinitionError, match=reason):
        parse_idl(text, "B.idl")


def test_the_catalog_reads_messages_services_and_actions(tmp_path: Path) -> None:
    empty = "uint8 structure_needs_at_least_one_member;"
    parts = {
        "msg": "struct Go { long x; };",
        "srv": f"struct Go_Request {{ {empty} }}; struct Go_Response {{ boolean ok; }};",
        "action": f"struct Go_Goal {{ short n; }}; struct Go_Result {{ {empty} }};"
        f"struct Go_Feedback {{ {empty} }};",
    }
    for kind, text in parts.items():
        (tmp_path / "demo" / kind).mkdir(parents=True)
        (tmp_path / "demo" / kind / "Go.idl").write_text(f"module demo {{ module {kind} {{ {text} }}; }};")
    catalog = Catalog(Distribution.JAZZY, installed_definitions(), [tmp_path])

    assert catalog.message("demo/msg/Go").text() == "int32 x\n"
    assert catalog.service("demo/srv/Go").request.text() == ""
    assert catalog.service("demo/srv/Go").response.text() == "bool ok\n"
    assert catalog.action("demo/action/Go").goal.text() == "int16 n\n"
    (tmp_path / "demo" / "msg" / "Other.idl").write_text("module demo { };")
    with pytest.raises(DefinitionError, match="the file does not define demo/msg/Other"):
        catalog.message("demo/msg/Other")


@pytest.mark.parametrize(("text", "reason"), [
    ('\\"' * 20_000, "a string does not end"), ("/* " * 20_000, None), ("\n" * 20_000, None),
    ("module a { " * 2_000, "modules are nested too deeply"),
    ("struct A { " + "sequence<" * 2_000, "arrays of arrays have no counterpart"),
])  # fmt: skip
def test_repeated_beginnings_are_read_in_linear_time(text: str, reason: str | None) -> None:
    before = time.process_time()
    with pytest.raises(DefinitionError, match=reason) if reason else contextlib.nullcontext():
        parse_idl(text, "Bad.idl")
    assert time.process_time() - before < 0.5


# The definitions of ROS 1 packages in ROS 2.


def translated(folder: Path, **files: str) -> Ros2Package:
    """Write files such as `msg__Status="int8 x"` to the package Demo, and translate it."""
    for name, text in files.items():
        kind, _, base = name.partition("__")
        (folder / kind).mkdir(parents=True, exist_ok=True)
        (folder / kind / f"{base}.{kind}").write_text(text)
    installed = installed_library().definitions.files.folder
    find = DefinitionFiles(lambda package: folder if package == "Demo" else installed(package))
    return ros2_package("Demo", "jazzy", Definitions(find))


def test_each_change_is_listed_and_made(tmp_path: Path) -> None:
    made = translated(
        tmp_path,
        msg__wheel_state=(
            "uint8 Off=0\nHeader header\ntime[] Stamps\nduration Wait__S\nint8[0] none\n"
            "sensor_msgs/Range range"
        ),
        msg__Robot="wheel_state[4] wheels\nstring name",
        srv__Stop="---\nbool done",
        action__Drive="float32 Distance\n---\n---\nRobot robot",
    )

    assert made.name == "demo"
    assert made.files == {
        "msg/WheelState.msg": (
            "uint8 OFF=0\nstd_msgs/Header header\nbuiltin_interfaces/Time[] stamps\n"
            "builtin_interfaces/Duration wait_s\nsensor_msgs/Range range\n"
        ),
        "msg/Robot.msg": "demo/WheelState[4] wheels\nstring name\n",
        "srv/Stop.srv": "---\nbool done\n",
        "action/Drive.action": "float32 distance\n---\n---\ndemo/Robot robot\n",
    }
    assert made.changes == (
        "Demo/Robot becomes demo/msg/Robot",
        "Demo/wheel_state becomes demo/msg/WheelState",
        "Demo/wheel_state: std_msgs/Header header becomes std_msgs/Header without seq",
        "Demo/wheel_state: time[] Stamps becomes builtin_interfaces/Time, stamps",
        "Demo/wheel_state: duration Wait__S becomes builtin_interfaces/Duration, wait_s",
        "Demo/wheel_state: int8[0] none becomes nothing, because ROS 2 has no arrays of length 0",
        "Demo/wheel_state: Off becomes OFF",
        "Demo/Stop becomes demo/srv/Stop",
        "Demo/Drive becomes demo/action/Drive",
        "Demo/DriveGoal: float32 Distance becomes distance",
    )
    assert made.needs == {
        *("action_msgs", "builtin_interfaces", "sensor_msgs", "service_msgs", "std_msgs"),
        "unique_identifier_msgs",
    }


def test_bundled_packages_are_those_of_ros2() -> None:
    definitions = installed_library().definitions

    tf2 = ros2_package("tf2_msgs", "jazzy", definitions)
    examples = ros2_package("example_interfaces", "kilted", definitions)

    assert sorted(tf2.files) == [
        "action/LookupTransform.action", "msg/TF2Error.msg", "msg/TFMessage.msg", "srv/FrameGraph.srv",
    ]  # fmt: skip
    assert tf2.changes == ()
    assert examples.files["srv/AddTwoInts.srv"] == "int64 a\nint64 b\n---\nint64 sum\n"
    assert (
        examples.files["action/Fibonacci.action"]
        == "int32 order\n---\nint32[] sequence\n---\nint32[] sequence\n"
    )


def test_types_that_ros2_lacks_are_named(tmp_path: Path) -> None:
    with pytest.raises(
        NotFound, match=r"Demo/msg/Old\.msg: the type std_msgs/msg/Time is unknown in ROS 2 jazzy"
    ):
        translated(tmp_path, msg__Old="std_msgs/Time stamp")
    with pytest.raises(NotFound, match="package rospy has no messages, services or actions"):
        ros2_package("rospy", "jazzy", installed_library().definitions)
    with pytest.raises(NotFound, match="there is no package nowhere"):
        ros2_package("nowhere", "jazzy", installed_library().definitions)
