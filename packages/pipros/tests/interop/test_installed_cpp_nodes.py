"""C++ nodes and nodelets that Debian installed, started by pipros' tools without any variable."""

from __future__ import annotations

import pytest

from pipros_workspace.index import SHARED_PACKAGES
from tests.support.environments import EXAMPLES
from tests.support.ros import RosSystem

LAUNCH = """<launch>
  <node name="manager" pkg="nodelet" type="nodelet" args="manager" required="true" output="screen"/>
  <node name="debayer" pkg="nodelet" type="nodelet" args="load image_proc/debayer manager" output="screen"/>
</launch>
"""
# A mosaic of one colour has that colour everywhere.
COLLECT = """import rospy
from sensor_msgs.msg import Image
rospy.init_node("collect")
row, next_row = bytes([200, 100] * 4), bytes([100, 50] * 4)
mosaic = Image(height=8, width=8, step=8, encoding="bayer_rggb8", data=(row + next_row) * 4)
camera = rospy.Publisher("image_raw", Image, queue_size=1)
rospy.Timer(rospy.Duration(0.1), lambda _: camera.publish(mosaic))
seen = rospy.wait_for_message("image_color", Image, timeout=60)
print(seen.encoding, seen.width, seen.height, set(zip(seen.data[::3], seen.data[1::3], seen.data[2::3])))
"""


@pytest.mark.timeout(300)
@pytest.mark.parametrize("path", [None, f"{EXAMPLES}:{SHARED_PACKAGES}"], ids=["fresh", "sourced"])
def test_a_nodelet_is_loaded_into_a_genuine_manager(plain_ros: RosSystem, path: str | None) -> None:
    side = plain_ros.pipros
    side.environment.pop("ROS_PACKAGE_PATH")
    if path is not None:
        side.environment["ROS_PACKAGE_PATH"] = path
    (plain_ros.home / "debayer.launch").write_text(LAUNCH)
    (plain_ros.home / "collect.py").write_text(COLLECT)
    side.environment["PIPROS_NODELETS"] = "genuine"
    launch = side.start("roslaunch", "-p", str(plain_ros.port), "debayer.launch")
    launch.wait_for(r"process\[debayer-\d+\]: started")

    collected = side.run("python3", "collect.py", timeout_s=120)

    assert collected.stdout == ["bgr8 8 8 {(50, 100, 200)}"], collected.output + launch.output


@pytest.mark.parametrize("path", ["", "/usr/share"])
@pytest.mark.parametrize(
    ("package", "program", "place"),
    [
        ("image_rotate", "image_rotate", "/usr/lib/image_rotate"),
        ("nodelet", "declared_nodelets", "/usr/lib/nodelet"),
        ("topic_tools", "throttle", f"{SHARED_PACKAGES}/topic_tools/scripts"),
        ("rosbag", "record", f"{SHARED_PACKAGES}/rosbag/"),
    ],
)
def test_rosrun_finds_programs_of_debian_and_of_pipros(
    plain_ros: RosSystem, package: str, program: str, place: str, path: str
) -> None:
    plain_ros.pipros.environment["ROS_PACKAGE_PATH"] = path
    found = plain_ros.pipros.run("rosrun", "--prefix", "/bin/echo", package, program)
    assert found.stdout[0].startswith(place), found.output


def test_queries_of_packages_keep_the_winner(plain_ros: RosSystem) -> None:
    plain_ros.pipros.environment["ROS_PACKAGE_PATH"] = "/usr/share"
    for package, folder in (
        ("nodelet", f"{SHARED_PACKAGES}/nodelet"),
        ("pluginlib", "/usr/share/pluginlib"),
    ):
        assert plain_ros.pipros.run("rospack", "find", package).stdout == [folder]
