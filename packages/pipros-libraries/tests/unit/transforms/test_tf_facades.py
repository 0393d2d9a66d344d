"""tf2_py, tf2_ros and tf without topics."""

import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import Any

import pytest
from geometry_msgs.msg import PointStamped, PoseStamped, TransformStamped

import rospy
import tf
import tf2_geometry_msgs
import tf2_py
import tf2_ros


@pytest.fixture(autouse=True)
def time() -> Iterator[None]:
    rospy.rostime.set_rostime_initialized(True)
    yield
    rospy.rostime.switch_to_wallclock()
    rospy.rostime.set_rostime_initialized(False)


def stamped(parent: str, child: str, second: float, x: float) -> TransformStamped:
    message = TransformStamped()
    message.header.frame_id, message.child_frame_id = parent, child
    message.header.stamp = rospy.Time.from_sec(second)
    message.transform.translation.x = x
    message.transform.rotation.w = 1.0
    return message


def test_a_transform_is_returned_as_it_was_set() -> None:
    core = tf2_py.BufferCore(rospy.Duration(5))
    core.set_transform(stamped("a", "b", 10, 4), "me")

    found = core.lookup_transform_core("a", "b", rospy.Time(10))

    assert (found.header.frame_id, found.child_frame_id, found.header.stamp) == ("a", "b", rospy.Time(10))
    assert found.transform == stamped("a", "b", 10, 4).transform
    assert core.can_transform_core("a", "c", rospy.Time(0)) == (
        0,
        "canTransform: source_frame c does not exist.",
    )


def test_a_wait_ends_when_the_transform_arrives() -> None:
    buffer = tf2_ros.Buffer(debug=False)
    sender = threading.Timer(0.05, lambda: buffer.set_transform(stamped("a", "b", 10, 4), "me"))
    sender.start()

    found = buffer.lookup_transform("a", "b", rospy.Time(10), rospy.Duration(60))

    sender.join()
    assert found.transform.translation.x == 4


def test_a_wait_for_nothing_ends_with_the_reason() -> None:
    buffer = tf2_ros.Buffer(debug=False)
    answer = buffer.can_transform("a", "b", rospy.Time(0), rospy.Duration(0.01), return_debug_tuple=True)

    assert answer[0] == 0
    assert "target_frame a does not exist" in answer[1]
    with pytest.raises(tf2_ros.LookupException):
        buffer.lookup_transform_full("a", rospy.Time(1), "b", rospy.Time(1), "c", rospy.Duration(0.01))


def test_a_wait_ends_when_simulated_time_restarts() -> None:
    rospy.rostime._set_rostime(rospy.Time(1_000_000))
    buffer = tf2_ros.Buffer(debug=False)
    is_over = threading.Event()

    def restart_repeatedly() -> None:  # so that one restart is after the beginning of the wait
        second = 1_000_000
        while not is_over.wait(0.05):
            second -= 10
            rospy.rostime._set_rostime(rospy.Time(second))

    back = threading.Thread(target=restart_repeatedly)
    back.start()
    try:
        assert not buffer.can_transform("a", "b", rospy.Time(0), rospy.Duration(1000))
    finally:
        is_over.set()
        back.join()


def test_registered_types_are_transformed_and_converted() -> None:
    buffer = tf2_ros.Buffer(debug=False)
    buffer.set_transform_static(stamped("a", "b", 0, 4), "me")
    point = PointStamped()
    point.header.frame_id = "b"
    point.point.x = 1.0

    assert buffer.transform(point, "a").point.x == 5.0
    full = buffer.transform_full(point, "a", rospy.Time(3), "b", new_type=PointStamped)
    assert (full.point.x, full.header.frame_id) == (5.0, "a")
    with pytest.raises(tf2_ros.TypeException, match="is registered for"):
        buffer.transform(stamped("a", "b", 0, 4), "a")


def test_a_pose_without_a_rotation_is_not_rotated() -> None:
    moved = tf2_geometry_msgs.do_transform_pose(PoseStamped(), stamped("a", "b", 0, 4))

    assert (moved.pose.position.x, moved.pose.orientation.w) == (4.0, 1.0)


def test_a_wait_ends_without_an_exception_when_the_node_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in genuine ROS: programs catch the exceptions of tf2 only."""
    monkeypatch.setattr(rospy, "is_shutdown", lambda: True)
    assert not tf2_ros.Buffer(debug=False).can_transform("a", "b", rospy.Time(), rospy.Duration(60))


def test_the_base_interface_raises_not_implemented() -> None:
    with pytest.raises(tf2_ros.NotImplementedException):
        tf2_ros.BufferInterface().can_transform("a", "b", rospy.Time(0))


def test_tf_accepts_names_with_a_slash() -> None:
    transformer = tf.TransformerROS(cache_time=rospy.Duration(5))
    transformer.setTransform(stamped("a", "b", 10, 4))

    assert transformer.lookupTransform("/a", "/b", rospy.Time(0)) == ([4, 0, 0], [0, 0, 0, 1])
    assert transformer.getFrameStrings() == ["b"]
    with pytest.raises(tf.Exception, match="dedicated thread"):
        transformer.waitForTransform("a", "b", rospy.Time(0), rospy.Duration(1))
    with pytest.raises(tf.LookupException):
        transformer.lookupTransform("a", "c", rospy.Time(0))


@pytest.mark.parametrize("wrong", [None, 5, "now"])
def test_a_time_of_the_wrong_type_is_refused(wrong: Any) -> None:
    with pytest.raises(TypeError, match="to_sec"):
        tf2_py.BufferCore().lookup_transform_core("a", "b", wrong)


def test_the_velocity_of_a_frame_is_that_around_the_time() -> None:
    transformer = tf.Transformer()
    for second in (10, 11, 12):
        transformer.setTransform(stamped("map", "base", second, second**2))

    velocities = [
        transformer.lookupTwist("base", "map", rospy.Time.from_sec(time), rospy.Duration(1))
        for time in (0, 11)
    ]

    assert velocities == [((23.0, 0.0, 0.0), (0.0, 0.0, 0.0)), ((22.0, 0.0, 0.0), (0.0, 0.0, 0.0))]


# tf_conversions and tf2_kdl without PyKDL.


PROGRAM = """
import sys; sys.modules['PyKDL'] = None
import tf_conversions
def use():
    tf_conversions.fromTf(((1, 2, 3), (0, 0, 0, 1)))
def load():
    import tf2_kdl
for each in (use, load):
    try:
        each()
    except ImportError as error:
        print(error)
"""


def test_without_pykdl_the_error_says_what_to_install() -> None:
    ended = subprocess.run([sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, text=True, check=True)
    for package, line in zip(("tf_conversions", "tf2_kdl"), ended.stdout.splitlines(), strict=True):
        assert f"{package} needs PyKDL" in line
        assert "python3-pykdl" in line
