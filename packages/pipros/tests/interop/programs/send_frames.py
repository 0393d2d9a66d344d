"""Publish a static frame `base` in `map`, and moving frames.

`arm` in `base` with tf2, `hand` in `arm` with tf.
"""

from geometry_msgs.msg import TransformStamped

import rospy
import tf
import tf2_ros

rospy.init_node("sender")
static, moving, old = (
    tf2_ros.StaticTransformBroadcaster(), tf2_ros.TransformBroadcaster(), tf.TransformBroadcaster(),
)  # fmt: skip
message = TransformStamped()
message.header.frame_id, message.child_frame_id = "map", "base"
message.header.stamp = rospy.Time.now()
message.transform.translation.x = 1.0
message.transform.rotation.w = 1.0
static.sendTransform(message)
rate = rospy.Rate(50)
while not rospy.is_shutdown():
    arm = TransformStamped()
    arm.header.frame_id, arm.child_frame_id = "base", "arm"
    arm.header.stamp = rospy.Time.now()
    arm.transform.translation.y = 2.0
    arm.transform.rotation.z = 1.0
    moving.sendTransform(arm)
    old.sendTransform((0.0, 0.0, 3.0), (0.0, 0.0, 0.0, 1.0), rospy.Time.now(), "hand", "arm")
    try:
        rate.sleep()
    except rospy.ROSInterruptException:
        break
