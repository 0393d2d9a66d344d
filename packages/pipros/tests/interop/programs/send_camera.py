"""A camera driver: images with a bright spot, and CameraInfo with the same timestamp."""

import numpy as np
from sensor_msgs.msg import CameraInfo, Image

import rospy
from cv_bridge import CvBridge

rospy.init_node("camera", anonymous=True)
bridge = CvBridge()
image_pub = rospy.Publisher("image_raw", Image, queue_size=10)
info_pub = rospy.Publisher("camera_info", CameraInfo, queue_size=10)
frame = np.full((48, 64, 3), 20, np.uint8)
frame[30:33, 40:43] = (250, 120, 90)
info = CameraInfo(width=64, height=48, distortion_model="plumb_bob", D=[-0.2, 0.1, 0.01, 0.0, 0.0])
info.K, info.R = [60.0, 0, 32, 0, 60, 24, 0, 0, 1], [1.0, 0, 0, 0, 1, 0, 0, 0, 1]
info.P = [60.0, 0, 32, 0, 0, 60, 24, 0, 0, 0, 1, 0]
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    message = bridge.cv2_to_imgmsg(frame, encoding="rgb8")
    message.header.stamp = info.header.stamp = rospy.Time.now()
    message.header.frame_id = info.header.frame_id = "camera_optical"
    image_pub.publish(message)
    info_pub.publish(info)
    rate.sleep()
