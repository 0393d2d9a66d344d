"""Find the bright spot in a camera's images, as perception nodes do, and publish its position."""

import numpy as np
from geometry_msgs.msg import PointStamped
from sensor_msgs.msg import CameraInfo, Image

import message_filters
import rospy
from cv_bridge import CvBridge, CvBridgeError
from image_geometry import PinholeCameraModel


class Finder:
    def __init__(self):
        self.bridge, self.model = CvBridge(), PinholeCameraModel()
        self.pub = rospy.Publisher("spot", PointStamped, queue_size=1)
        image_sub = message_filters.Subscriber("image_raw", Image)
        info_sub = message_filters.Subscriber("camera_info", CameraInfo)
        self.sync = message_filters.TimeSynchronizer([image_sub, info_sub], 10)
        self.sync.registerCallback(self.callback)

    def callback(self, image, info):
        try:
            gray = self.bridge.imgmsg_to_cv2(image, desired_encoding="mono8")
        except CvBridgeError as error:
            rospy.logerr(error)
            return
        self.model.fromCameraInfo(info)
        rows, columns = np.nonzero(gray > 100)
        uv = self.model.rectifyPoint((columns.mean(), rows.mean()))
        found = PointStamped(header=image.header)
        found.point.x, found.point.y, found.point.z = self.model.projectPixelTo3dRay(uv)
        self.pub.publish(found)


if __name__ == "__main__":
    rospy.init_node("finder", anonymous=True)
    Finder()
    rospy.spin()
