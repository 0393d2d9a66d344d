"""The definitions of ROS 1 packages in ROS 2."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.importing.hook import installed_library
from pipros.msg.language.definition_files import DefinitionFiles
from pipros.msg.language.definitions import Definitions
from pipros_rosbag2.interfaces.package import Ros2Package, ros2_package


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
        "action/LookupTransform.action",
        "msg/TF2Error.msg",
        "msg/TFMessage.msg",
        "srv/FrameGraph.srv",
    ]
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
