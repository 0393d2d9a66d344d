"""Test programs for Python in a browser, which has no sockets, threads or processes.

`tests.tree.test_other_systems` runs them in a simulated browser, `tests.pyodide` in Pyodide. Each program
runs in an empty folder. `BEGINNING` must be put before each.
"""

BEGINNING = "import io\nfrom pathlib import Path\n"

PROGRAMS = {
    "messages": """
from pipros.msg.dynamic import message_classes_from_text
from pipros import load_message_class, load_service_class

text = "uint8 FULL=100\\nstring name\\nfloat64[] cells"
Level = message_classes_from_text("robot/Level", text)["robot/Level"]
buffer = io.BytesIO()
Level(name="front", cells=[1.5, 2.5]).serialize(buffer)
read = Level().deserialize(buffer.getvalue())
assert (read.name, list(read.cells), read.FULL) == ("front", [1.5, 2.5], 100)
assert load_message_class("std_msgs/String")(data="x").data == "x"
assert load_service_class("std_srvs/SetBool")._request_class(data=True).data
""",
    "own package": """
import os
folder = Path("packages/my_robot")
(folder / "msg").mkdir(parents=True)
(folder / "package.xml").write_text(
    '<package format="2"><name>my_robot</name><version>1.0.0</version><description>d</description>'
    '<maintainer email="a@b.c">m</maintainer><license>l</license></package>'
)
(folder / "msg/Level.msg").write_text("Header header\\nfloat32 charge\\n")
os.environ["ROS_PACKAGE_PATH"] = str(folder.parent.absolute())
from my_robot.msg import Level

assert Level(charge=0.5).charge == 0.5
assert "charge: 0.5" in str(Level(charge=0.5))
""",
    "bags": """
import rosbag, rospy
from pipros_tools.bag import BagReader
from std_msgs.msg import String

for compression in ("none", "bz2"):
    with rosbag.Bag("run.bag", "w", compression=compression) as bag:
        for second in (1, 2):
            bag.write("/chat", String(f"{compression} {second}"), rospy.Time(second))
    with BagReader(Path("run.bag")) as reader:
        assert [chunk.data for _, chunk, _, _ in reader] == [f"{compression} 1", f"{compression} 2"]
        assert reader.chunk_header(0).compression == compression
    with rosbag.Bag("run.bag") as bag:
        read = [(topic, time.to_sec()) for topic, _, time in bag.read_messages(start_time=rospy.Time(2))]
        assert read == [("/chat", 2.0)]
""",
    "mcap": """
from pipros_tools.bag import TopicWriter, open_bag
from pipros_tools.bag.mcap_files import McapWriter
from std_msgs.msg import String

with open("run.mcap", "w+b") as file:
    writer = McapWriter(file, compression="none")
    topics = TopicWriter(writer)
    for second in (1, 2):
        topics.write("/chat", String(str(second)), second, 0)
    writer.finish()
with open_bag("run.mcap") as reader:
    assert reader.format_name == "mcap"
    assert [(topic, message.data) for topic, message, _, _ in reader] == [("/chat", "1"), ("/chat", "2")]
""",
    "transforms": """
import rospy, tf2_ros
from geometry_msgs.msg import TransformStamped
from pipros_libraries.transforms.buffer import TransformBuffer

frames = TransformBuffer()
for second in (1, 3):
    frames.insert("map", "base", second * 10**9, (second, 0, 0, 0, 0, 0, 1), "test")
assert frames.lookup("map", "base", 2 * 10**9)[1][0] == 2.0

buffer = tf2_ros.BufferCore()
moved = TransformStamped()
moved.header.frame_id, moved.child_frame_id = "map", "base"
moved.transform.translation.x, moved.transform.rotation.w = 5.0, 1.0
buffer.set_transform_static(moved, "test")
assert buffer.lookup_transform_core("base", "map", rospy.Time(7)).transform.translation.x == -5.0
""",
    "filters": """
import message_filters
from geometry_msgs.msg import PointStamped

def stamped(second):
    message = PointStamped()
    message.header.stamp.secs = second
    return message

sets = []
inputs = message_filters.SimpleFilter(), message_filters.SimpleFilter()
message_filters.TimeSynchronizer(inputs, 5).registerCallback(lambda *found: sets.append(found))
cache = message_filters.Cache(inputs[0], 5)
for number, second in ((0, 1), (0, 2), (1, 2)):
    inputs[number].signalMessage(stamped(second))
assert [[message.header.stamp.secs for message in found] for found in sets] == [[2, 2]]
assert cache.getLastestTime().secs == 2
""",
    "urdf": """
from math import pi
from pipros_libraries.robot_model.joint_poses import pose_of
from pipros_libraries.robot_model.urdf import read_robot

robot = read_robot(
    '<robot name="arm"><link name="base"/><link name="upper"/><joint name="shoulder" type="revolute">'
    '<parent link="base"/><child link="upper"/><origin xyz="0 0 1"/><axis xyz="0 0 1"/>'
    '<limit lower="-1.5" upper="1.5" effort="10" velocity="1"/></joint></robot>'
)
assert (robot.root, [joint.name for joint in robot.joints]) == ("base", ["shoulder"])
x, y, z, *rotation = pose_of(robot.joints[0], pi)
assert (x, y, z, round(rotation[2], 6)) == (0, 0, 1, 1)
""",
}
"""Programs that use libraries that need no sockets, threads or processes."""

LIMITS = {
    "sockets": """
import rospy
from pipros import Core, Master, Node
from pipros.basics.errors import NeedsSockets

EXPECTED = "nodes, masters and their clients need sockets and threads, which a browser lacks"
for attempt in (
    lambda: rospy.init_node("talker"),
    lambda: rospy.get_param("/rate"),
    lambda: rospy.get_published_topics(),
    Node("talker").start,
    Core(port=0).start,
    Master(port=0).start,
):
    try:
        attempt()
    except NeedsSockets as error:
        assert str(error) == EXPECTED
    else:
        raise AssertionError("no error")
""",
    "commands": """
import contextlib, sys
from pipros_tools.cli import rosmsg, rosnode, rostopic

def run(main, *arguments):
    output = io.StringIO()
    sys.argv = ["command", *arguments]
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
        code = main()
    return code, output.getvalue()

assert run(rosmsg.main, "show", "std_msgs/String") == (0, "string data\\n\\n")
NO_SOCKETS = "ERROR: nodes, masters and their clients need sockets and threads, which a browser lacks\\n"
assert run(rosnode.main, "list") == run(rostopic.main, "list") == (1, NO_SOCKETS)
""",
}
"""Programs that check the errors of functions and commands that need sockets."""
