"""robot_state_publisher, joint_state_publisher and markers of both sides."""

import itertools
import shutil
from pathlib import Path

import pytest

from tests.support.robot import make_robot_package
from tests.support.ros import RosSystem

MODULES = Path("/usr/lib/python3/dist-packages")
COLLECT = """import rospy
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
rospy.init_node("collect")
told = rospy.wait_for_message("joint_states", JointState, timeout=30)
print(told.name, told.position, told.velocity, told.effort, repr(told.header.frame_id))
moving = rospy.wait_for_message("tf", TFMessage, timeout=30)
while len(moving.transforms) < 4:
    moving = rospy.wait_for_message("tf", TFMessage, timeout=30)
fixed = rospy.wait_for_message("tf_static", TFMessage, timeout=30)
for each in moving.transforms + sorted(fixed.transforms, key=lambda each: each.child_frame_id):
    p, q = each.transform.translation, each.transform.rotation
    numbers = [round(value, 6) + 0.0 for value in (p.x, p.y, p.z, q.x, q.y, q.z, q.w)]
    print(each.header.frame_id, each.child_frame_id, *numbers)
"""
PARAMETERS = {
    "plain": "{}",
    "chosen": """{zeros: {shoulder: 0.75},
                  dependent_joints: {elbow: {parent: shoulder, factor: 2, offset: 1}},
                  publish_default_velocities: true, publish_default_efforts: true, tf_prefix: /left}""",
    "without mimic": "{use_mimic_tags: false}",
}


def program(side: str, name: str) -> list[str]:
    """Return the command line of a node: Debian's packages of both are found by path."""
    return ["rosrun", name, name] if side == "pipros" else [f"/usr/lib/{name}/{name}"]


@pytest.mark.parametrize("chosen", PARAMETERS)
def test_the_frames_and_joints_are_the_same(plain_ros: RosSystem, chosen: str) -> None:
    package = make_robot_package(plain_ros.home / "src")
    pipros, genuine = plain_ros.pipros, plain_ros.genuine
    pipros.environment["ROS_PACKAGE_PATH"] = str(package.parent)
    plain_ros.serve_master()
    sides = {"pipros": pipros, "genuine": genuine}
    (plain_ros.home / "chosen.yaml").write_text(PARAMETERS[chosen])
    loaded = pipros.run("rosparam", "load", plain_ros.home / "chosen.yaml", "/")
    assert loaded.returncode == 0, loaded.output
    described = pipros.run("rosrun", "xacro", "xacro", package / "urdf" / "arm.urdf.xacro")
    pipros.run("rosparam", "set", "robot_description", "\n".join(described.stdout))
    (plain_ros.home / "collect.py").write_text(COLLECT)
    # The genuine joint_state_publisher is Python: unmodified, it runs on pipros' rospy, too.
    modules = plain_ros.home / "modules"
    shutil.copytree(MODULES / "joint_state_publisher", modules / "joint_state_publisher")
    collected = {}
    for joints, frames in [*itertools.product(("pipros", "genuine"), repeat=2), ("unmodified", "pipros")]:
        if joints == "unmodified":
            script = program("genuine", "joint_state_publisher")
            publisher = pipros.start("python3", *script, PYTHONPATH=str(modules))
        else:
            publisher = sides[joints].start(*program(joints, "joint_state_publisher"))
        started = [publisher, sides[frames].start(*program(frames, "robot_state_publisher"))]
        ended = pipros.run("python3", plain_ros.home / "collect.py", timeout_s=90)
        for process in started:
            process.press_ctrl_c()
            process.wait()
        assert ended.returncode == 0, ended.output + started[1].output
        collected[joints, frames] = ended.stdout

    assert len(collected["genuine", "genuine"]) == 7
    for pair, lines in collected.items():
        assert lines == collected["genuine", "genuine"], pair


# Servers of interactive markers of both sides send the same messages.
MARKERS = Path(__file__).parent / "programs" / "serve_markers.py"


def test_a_server_sends_the_same_messages(plain_ros: RosSystem) -> None:
    plain_ros.serve_master()

    genuine = plain_ros.genuine.run("python3", MARKERS, timeout_s=60)
    ours = plain_ros.pipros.run("python3", MARKERS, timeout_s=60)

    assert genuine.returncode == 0, genuine.output
    assert len(genuine.stdout) > 3000
    assert ours.stdout == genuine.stdout, ours.output
