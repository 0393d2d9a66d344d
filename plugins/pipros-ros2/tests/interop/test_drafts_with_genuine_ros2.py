"""Drafts of `pipros port` run with genuine rclpy, if nothing in them is marked with a TODO."""

from pathlib import Path

import pytest

from pipros_ros2.port.draft import draft_of
from pipros_rosbag2.interfaces.installed import installed_definitions
from tests.support.dds_peers import enable_multicast
from tests.support.network import LoneNetwork, needs_network
from tests.support.processes import Processes
from tests.support.ros2_wheels import DISTROS, environment

pytestmark = needs_network

TIMES = """
import rospy
from sensor_msgs.msg import Imu

class Monitor:
    def __init__(self):
        self.last = None
        self.publisher = rospy.Publisher("imu", Imu, queue_size=1)
        rospy.Subscriber("imu", Imu, self.receive)
        self.timer = rospy.Timer(rospy.Duration(0.1), self.publish)

    def publish(self, event):
        message = Imu()
        message.header.stamp = rospy.Time.now()
        message.header.stamp += rospy.Duration(1)
        self.publisher.publish(message)

    def receive(self, message):
        if self.last is not None and message.header.stamp > rospy.Time(0):
            print("between", 0 < (message.header.stamp - self.last.header.stamp).to_sec() < 60)
            print("ahead", -60 < (rospy.Time.now() - self.last.header.stamp).to_sec() < 60)
            print("newer", self.last.header.stamp < message.header.stamp <= self.limit(), flush=True)
        self.last = message

    def limit(self):
        return rospy.Time.now() + rospy.Duration(60)

rospy.init_node("monitor")
monitor = Monitor()
rospy.spin()
"""

VALUES = """
import rospy
from geometry_msgs.msg import Pose
from std_msgs.msg import Bool
from std_srvs.srv import SetBool

def receive(message, name):
    print(name, getattr(message, "data", getattr(message, "position", None)), flush=True)

rospy.init_node("values")
publishers = {name: rospy.Publisher(name, kind, queue_size=1, latch=True) for name, kind in (("pose", Pose),)}
publishers["flag"] = rospy.Publisher("flag", Bool, queue_size=1)
for name, kind in (("pose", Pose), ("flag", Bool)):
    rospy.Subscriber(name, kind, receive, name)
for name in ("one", "two"):
    rospy.Service(name, SetBool, lambda request, name=name: {"success": 1, "message": name})
pose = Pose()
point = pose.position
point.x, point.y = 1, 2
point.z = pose.orientation.w = 3
rospy.wait_for_service("one")
print("service", rospy.ServiceProxy("one", SetBool)(1).message)
while not rospy.is_shutdown():
    publishers["pose"].publish(pose)
    publishers["flag"].publish(Bool(1))
    rospy.sleep(0.1)
"""
EXPECTED = {
    TIMES: ("between True", "ahead True", "newer True"),
    VALUES: (r"pose geometry_msgs.msg.Point\(x=1.0, y=2.0, z=3.0\)", "flag True", "service one"),
}


@pytest.mark.parametrize("source", EXPECTED, ids=["times", "values"])
@pytest.mark.parametrize("distro", DISTROS)
def test_a_draft_without_todos_does_what_the_node_did(
    distro: str, source: str, tmp_path: Path, processes: Processes
) -> None:
    text = draft_of(source, installed_definitions()).text
    assert "TODO" not in text
    file = tmp_path / "monitor.py"
    file.write_text(text)
    network = LoneNetwork("127.0.0.1 localhost\n")
    try:
        enable_multicast(network)
        python = str(environment(distro) / "bin" / "python")
        node = processes.start(*network.command(python, str(file)))
        for line in EXPECTED[source]:
            node.wait_for(f"^{line}$")
    finally:
        processes.end_all()
        network.close()
