"""Genuine nodes and tools drive turtlesim of pipros."""

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
    pub = ["rostopic", "pub", "-1", "/turtle1/cmd_vel", "geometry_msgs/Twist", "[300.0, 0.0, 0.0]"]
    moved = ros.genuine.run(*pub, "[0.0, 0.0, 0.0]")
    assert moved.returncode == 0, moved.output
    turtlesim.wait_for("I hit the wall")
