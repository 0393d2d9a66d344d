"""Genuine nodes and tools drive turtlesim of pipros, and read its poses without classes for them."""

from __future__ import annotations

from tests.support.ros import RosSystem

DRIVER = """
import rospy
from std_srvs.srv import Empty

rospy.init_node("driver")
rospy.wait_for_service("/clear")
rospy.ServiceProxy("/clear", Empty)()
print("cleared")
"""


def test_genuine_nodes_and_tools_drive_turtles(ros: RosSystem) -> None:
    ros.genuine.start_master()
    turtlesim = ros.pipros.start("rosrun", "turtlesim", "turtlesim_node")
    ros.wait_for_subscriber("/turtle1/cmd_vel")
    driver = ros.genuine.home / "driver.py"
    driver.write_text(DRIVER)
    ros.genuine.start("/usr/bin/python3", driver).wait_for("cleared")
    turtlesim.wait_for("Clearing turtlesim")
    pub = ["rostopic", "pub", "/turtle1/cmd_vel", "geometry_msgs/Twist", "[300.0, 0.0, 0.0]"]
    moving = ros.genuine.start(*pub, "[0.0, 0.0, 0.0]")
    turtlesim.wait_for("I hit the wall", 60)
    moving.press_ctrl_c()
    assert moving.wait() == 0, moving.output


FOLLOWER = """
import struct
import rospy
from geometry_msgs.msg import Twist

rospy.init_node("follower")
commands = rospy.Publisher("turtle1/cmd_vel", Twist, queue_size=1)
command = Twist()
command.linear.x, command.angular.z = 1.5, 0.5
pose = rospy.wait_for_message("turtle1/pose", rospy.AnyMsg, timeout=30)
print(pose._connection_header["type"], pose._connection_header["md5sum"])
x, linear, start = 0.0, 0.0, struct.unpack("<5f", pose._buff)
print(*(round(value, 4) for value in start))
rate = rospy.Rate(10)
while x < start[0] + 0.5 or not linear:  # a turtle stops a second after a command
    commands.publish(command)
    rate.sleep()
    pose = rospy.wait_for_message("turtle1/pose", rospy.AnyMsg, timeout=30)
    x, y, theta, linear, angular = struct.unpack("<5f", pose._buff)
print("drives", linear, angular, theta > 0)
"""


def test_a_genuine_node_steers_by_the_poses_of_a_turtle(ros: RosSystem) -> None:
    ros.genuine.start_master()
    ros.pipros.start("rosrun", "turtlesim", "turtlesim_node", "_headless:=true")
    ros.wait_for_subscriber("/turtle1/cmd_vel")
    follower = ros.genuine.home / "follower.py"
    follower.write_text(FOLLOWER)
    ended = ros.genuine.run("/usr/bin/python3", follower, timeout_s=120)
    assert ended.stdout == [
        "turtlesim/Pose 863b248d5016ca62ea2e895ae5265cf9",
        "5.5444 5.5444 0.0 0.0 0.0",
        "drives 1.5 0.5 True",
    ], ended.output
