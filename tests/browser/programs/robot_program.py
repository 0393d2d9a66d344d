"""A node that publishes a little of all that the page shows, with pipros or with genuine rospy."""

import contextlib
import math
import sys

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import Image, Imu
from tf2_msgs.msg import TFMessage

import rospy

rospy.init_node(sys.argv[1])
images = rospy.Publisher("camera/image_raw", Image, queue_size=1)
imus = rospy.Publisher("imu", Imu, queue_size=1)
diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)
transforms = rospy.Publisher("/tf", TFMessage, queue_size=10)
rospy.set_param("~wheel_radius", 0.15)
rate = rospy.Rate(20)
count = 0
while not rospy.is_shutdown():
    count += 1
    red = b"\xff\x00\x00"
    images.publish(Image(width=8, height=4, step=24, encoding="rgb8", data=red * 32))
    imu = Imu()
    imu.angular_velocity.x = math.sin(count / 20.0)
    imus.publish(imu)
    hot = DiagnosticStatus(
        level=1, name="/Motors/left", message="warm", values=[KeyValue("temperature", "70")]
    )
    diagnostics.publish(DiagnosticArray(status=[hot]))
    transform = TransformStamped()
    transform.header.stamp = rospy.Time.now()
    transform.header.frame_id, transform.child_frame_id = "map", "base_link"
    transform.transform.rotation.w = 1.0
    transforms.publish(TFMessage([transform]))
    if count % 10 == 0:
        rospy.logwarn("wheel slips: %d", count)
    with contextlib.suppress(rospy.ROSInterruptException):
        rate.sleep()
