"""Reported faults of libraries: actionlib, dynamic_reconfigure, numpy in messages, cv_bridge."""

import io
import sys
from collections.abc import Callable
from typing import Any

import numpy
import pytest
from geometry_msgs.msg import Point, PoseWithCovariance
from sensor_msgs.msg import Image, JointState, LaserScan
from std_msgs.msg import Float64, Float64MultiArray, Int32, Int32MultiArray, String

import cv_bridge
import genpy
from pipros.master.master import Master
from pipros_libraries.reconfigure.generator import ParameterGenerator
from tests.support.processes import Processes

# actionlib: goals with the same or no ID, and cancellations that arrive before their goals, were lost.


SCRIPT = """
import time

import actionlib
import rospy
from actionlib_msgs.msg import GoalID, GoalStatusArray
from actionlib_tutorials.msg import FibonacciAction, FibonacciActionGoal

rospy.init_node("node")
calls, statuses = [], []

def on_goal(goal):
    goal.set_accepted()
    calls.append(goal.get_goal_id().id)

server = actionlib.ActionServer("fib", FibonacciAction, on_goal, auto_start=False)
server.start()
goals = rospy.Publisher("fib/goal", FibonacciActionGoal, queue_size=10)
cancels = rospy.Publisher("fib/cancel", GoalID, queue_size=10)
rospy.Subscriber("fib/status", GoalStatusArray, lambda message: statuses.append(message.status_list))

def wait(condition):
    end = time.monotonic() + 30
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)

wait(lambda: goals.get_num_connections() and cancels.get_num_connections())
cancels.publish(GoalID(id="early"))
wait(lambda: any(len(each) == 1 for each in statuses))
for name in ("early", "one", "one", "", "", "last"):
    goals.publish(FibonacciActionGoal(goal_id=GoalID(rospy.Time.now(), name)))
wait(lambda: "last" in calls)
server.publish_status()
wait(lambda: statuses and len(statuses[-1]) == 5)
print([name if name in ("one", "last") else name.startswith("/node-") for name in calls])
print(len(set(calls)), [each.status for each in statuses[-1]])
"""


def test_goals_are_accepted_once_and_early_cancellations_count(processes: Processes, master: Master) -> None:
    node = processes.run(sys.executable, "-c", SCRIPT, environment={"ROS_MASTER_URI": master.uri})
    assert node.stdout == ["['one', True, True, 'last']", "4 [8, 1, 1, 1, 1]"], node.output


# dynamic_reconfigure: one value of the wrong type in a request, and the server changed nothing at all.


CFG = """
from dynamic_reconfigure.parameter_generator_catkin import *
gen = ParameterGenerator()
gen.add("count", int_t, 1, "", 5, 0, 99)
gen.add("speed", double_t, 2, "", 1.0, -10, 10)
gen.add("name", str_t, 4, "", "a")
exit(gen.generate("robot_pkg", "node", "Robot"))
"""
RECONFIGURED_SCRIPT = """
import rospy
from dynamic_reconfigure.msg import Config, DoubleParameter, IntParameter, StrParameter
from dynamic_reconfigure.server import Server
from dynamic_reconfigure.srv import Reconfigure
from robot_pkg.cfg import RobotConfig

def callback(config, level):
    print(level, *(config[name] for name in ("count", "speed", "name")))
    return config

rospy.init_node("robot")
server = Server(RobotConfig, callback)
request = Config(ints=[IntParameter("speed", 3), IntParameter("name", 7)])
request.strs = [StrParameter("count", "many")]
answer = rospy.ServiceProxy("/robot/set_parameters", Reconfigure)(request).config
print([each.name for each in answer.ints], [(each.name, each.value) for each in answer.doubles])
"""


def test_values_of_another_type_are_converted_or_not(processes: Processes, tmp_path, master: Master) -> None:
    package = tmp_path / "robot_pkg"
    (package / "cfg").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>robot_pkg</name><version>1.0.0</version></package>")
    (package / "cfg" / "Robot.cfg").write_text(CFG)
    environment = {"ROS_MASTER_URI": master.uri, "ROS_PACKAGE_PATH": str(tmp_path)}
    node = processes.run(sys.executable, "-c", RECONFIGURED_SCRIPT, environment=environment)
    assert node.stdout == ["-1 5 1.0 a", "6 5 3.0 7", "['count'] [('speed', 3.0)]"], node.output
    assert "a client's value is ignored: can't set parameter 'count'" in node.output


def test_no_parameter_takes_the_name_of_the_groups() -> None:
    with pytest.raises(ValueError, match="a parameter must not be named groups"):
        ParameterGenerator().add("groups", "int", 0, "")


# ROS Answers: numpy values in fields failed when they were published, or were written wrongly.


np: Any = numpy  # the stubs of messages name the types of Python alone


def sent(message: Any) -> Any:
    content = io.BytesIO()
    message.serialize(content)
    return type(message)().deserialize(content.getvalue())


GOOD: dict[str, tuple[Callable[[], Any], Callable[[Any], Any], Any]] = {
    "float32 as float64": (lambda: Float64(np.float32(1.5)), lambda m: m.data, 1.5),
    "int64 as int32": (lambda: Int32(np.int64(7)), lambda m: m.data, 7),
    "str": (lambda: String(np.str_("x")), lambda m: m.data, "x"),
    "items": (lambda: Point(*np.array([1, 2, 3])), lambda m: (m.x, m.y, m.z), (1.0, 2.0, 3.0)),
    "integers as floats": (
        lambda: Float64MultiArray(data=np.array([1, 2])), lambda m: list(m.data), [1.0, 2.0]),
    "int64 array": (lambda: Int32MultiArray(data=np.array([1, 2])), lambda m: list(m.data), [1, 2]),
    "float64 array": (lambda: LaserScan(ranges=np.array([1.0, 2.5])), lambda m: list(m.ranges), [1.0, 2.5]),
    "covariance": (
        lambda: PoseWithCovariance(covariance=np.arange(36)), lambda m: m.covariance[34:], (34.0, 35.0)),
    "texts": (lambda: JointState(name=np.array(["a", "b"])), lambda m: m.name, ["a", "b"]),
    "pixels": (  # Noetic refuses them
        lambda: Image(data=np.arange(9, dtype=np.uint8).reshape(1, 3, 3)), lambda m: m.data, bytes(range(9))),
}  # fmt: skip


@pytest.mark.parametrize("case", GOOD)
def test_numpy_values_that_fit_are_sent(case: str) -> None:
    make, value_of, expected = GOOD[case]
    assert value_of(sent(make())) == expected


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: Int32(np.float64(7.0)), "data"),
        (lambda: Int32MultiArray(data=np.array([1.0, 2.0])), "data"),
        (lambda: Image(data=np.array([1, 2, 3])), "data"),  # 8 bytes each
        (lambda: PoseWithCovariance(covariance=np.zeros((6, 6))), "covariance"),
        (lambda: PoseWithCovariance(covariance=np.zeros(35)), "covariance"),
    ],
)
def test_numpy_values_that_do_not_fit_are_errors_with_the_field(make: Callable[[], Any], name: str) -> None:
    with pytest.raises(genpy.SerializationError, match=f"field {name} must be"):
        sent(make())


# vision_opencv: views, transposed and big-endian arrays, or one channel, gave scrambled images.


WHOLE: Any = np.arange(96, dtype=np.uint8).reshape(4, 8, 3)


@pytest.mark.parametrize(("array", "encoding"), [
    (WHOLE[:, ::2], "bgr8"), (WHOLE[::-1], "bgr8"), (WHOLE[..., ::-1], "rgb8"), (WHOLE[1:3, 2:5], "bgr8"),
    (np.asfortranarray(WHOLE), "bgr8"), (WHOLE.transpose(1, 0, 2), "bgr8"), (WHOLE[..., 0], "mono8"),
    (WHOLE[..., :1], "mono8"), (WHOLE[..., 0].astype(">u2"), "mono16"), (WHOLE[..., 0].astype("f4"), "32FC1"),
    (WHOLE[:0], "bgr8"),
])  # fmt: skip
def test_an_array_arrives_as_it_was(array: Any, encoding: str) -> None:
    bridge = cv_bridge.CvBridge()
    message = bridge.cv2_to_imgmsg(array, encoding)
    assert (message.height, message.width) == array.shape[:2]
    found = bridge.imgmsg_to_cv2(message)
    assert np.array_equal(found, array.reshape(found.shape))
    assert (found.dtype.kind, found.dtype.itemsize) == (array.dtype.kind, array.dtype.itemsize)
