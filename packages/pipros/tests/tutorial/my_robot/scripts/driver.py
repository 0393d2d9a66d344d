#!/usr/bin/env python3
"""Publish what a small robot with an arm, a laser and a camera measures."""

import numpy as np
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState, LaserScan
from tf2_msgs.msg import TFMessage

import rospy
from cv_bridge import CvBridge

PICTURE = np.zeros((48, 64, 3), np.uint8)


def measured(stamp, number):
    """Return the messages of one moment, by topic."""
    image = CvBridge().cv2_to_imgmsg(PICTURE + number % 256, "rgb8")
    compressed = CvBridge().cv2_to_compressed_imgmsg(PICTURE + number % 256)
    transforms = [TransformStamped(child_frame_id="base_link"), TransformStamped(child_frame_id="laser")]
    for parent, each in zip(("odom", "base_link"), transforms, strict=True):
        each.header.frame_id, each.transform.rotation.w = parent, 1.0
    joints = JointState(name=["shoulder", "elbow"], position=[0.01 * number, 0.02 * number])
    scan = LaserScan(angle_max=1.0, angle_increment=0.5, range_max=10.0, ranges=[1.0, 2.0, 3.0])
    odometry = Odometry(child_frame_id="base_link")
    odometry.pose.pose.orientation.w = 1.0
    found = {
        "/scan": scan,
        "/odom": odometry,
        "/imu/data": Imu(),
        "/joint_states": joints,
        "/arm/command": JointState(name=joints.name, position=joints.position),
        "/camera/image_raw": image,
        "/camera/image_raw/compressed": compressed,
        "/tf": TFMessage(transforms),
    }
    frames = {"/scan": "laser", "/odom": "odom", "/imu/data": "base_link", "/camera/image_raw": "camera"}
    for topic, each in (*found.items(), *(("", transform) for transform in transforms)):
        if topic != "/tf":
            each.header.stamp = stamp
            each.header.frame_id = frames.get(topic, each.header.frame_id)
    return found


def main():
    rospy.init_node("driver")
    types = {topic: type(message) for topic, message in measured(rospy.Time(), 0).items()}
    publishers = {topic: rospy.Publisher(topic, each, queue_size=10) for topic, each in types.items()}
    rate = rospy.Rate(rospy.get_param("~rate", 10))
    number = 0
    while not rospy.is_shutdown():
        for topic, message in measured(rospy.Time.now(), number).items():
            publishers[topic].publish(message)
        number += 1
        rate.sleep()


if __name__ == "__main__":
    main()
