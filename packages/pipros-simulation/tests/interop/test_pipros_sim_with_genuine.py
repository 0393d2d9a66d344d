"""Genuine nodes and tools drive a robot of pipros_sim, and read what it measures."""

from __future__ import annotations

import pytest

from tests.support.ros import RosSystem

DRIVER = """
import math
import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from std_srvs.srv import SetBool
from tf2_msgs.msg import TFMessage

rospy.init_node("driver")
scan = rospy.wait_for_message("scan", LaserScan, timeout=30)
print("scan", scan.header.frame_id, len(scan.ranges), round(scan.ranges[180], 1))
fixed = rospy.wait_for_message("tf_static", TFMessage, timeout=30)
print("fixed", *(each.child_frame_id for each in fixed.transforms))
rospy.wait_for_service("charge", 30)
print("charge", rospy.ServiceProxy("charge", SetBool)(True).message)
commands = rospy.Publisher("cmd_vel", Twist, queue_size=1, latch=True)
command = Twist()
command.linear.x, command.angular.z = 0.4, 0.2
commands.publish(command)
odometry = Odometry()
while odometry.pose.pose.position.x < 0.1:
    odometry = rospy.wait_for_message("odom", Odometry, timeout=30)
print("odom", odometry.header.frame_id, odometry.child_frame_id, round(odometry.twist.twist.linear.x, 3))
(moving,) = rospy.wait_for_message("tf", TFMessage, timeout=30).transforms
while moving.header.stamp < odometry.header.stamp:
    (moving,) = rospy.wait_for_message("tf", TFMessage, timeout=30).transforms
shift = moving.transform.translation
print("tf", moving.header.frame_id, moving.child_frame_id, math.hypot(shift.x, shift.y) > 0.1)
"""


@pytest.mark.timeout(300)
def test_genuine_nodes_and_tools_use_a_simulated_robot(ros: RosSystem) -> None:
    ros.genuine.start_master()
    sim = ros.pipros.start("rosrun", "pipros_sim", "sim", "_headless:=true")
    sim.wait_for("Simulating 1 robot ")
    driver = ros.genuine.home / "driver.py"
    driver.write_text(DRIVER)
    driven = ros.genuine.run("/usr/bin/python3", driver, timeout_s=150)
    assert driven.stdout == [
        "scan base_scan 360 4.9", "fixed base_link base_scan imu_link", "charge charging",
        "odom odom base_footprint 0.4", "tf odom base_footprint True",
    ], driven.output  # fmt: skip
    assert ros.genuine.run("rostopic", "type", "/scan").stdout == ["sensor_msgs/LaserScan"]
    echoed = ros.genuine.run("rostopic", "echo", "-n1", "/battery_state/header/frame_id")
    assert echoed.returncode == 0, echoed.output
    assert ros.genuine.run("rosservice", "call", "/reset_positions").returncode == 0
    measured = ros.genuine.start("rostopic", "hz", "/odom")
    measured.wait_for(r"average rate: \d+\.")
