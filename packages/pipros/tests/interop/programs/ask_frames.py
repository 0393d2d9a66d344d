"""Print the pose of `hand` in `map` from tf2_ros and tf, and the response of the service of frames."""

import yaml
from geometry_msgs.msg import PointStamped
from tf2_msgs.srv import FrameGraph

import rospy
import tf
import tf2_geometry_msgs  # noqa: F401 # registers points
import tf2_ros

rospy.init_node("asker")
buffer = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(buffer)
found = buffer.lookup_transform("map", "hand", rospy.Time(0), rospy.Duration(30)).transform
print(found.translation.x, found.translation.y, found.translation.z, abs(found.rotation.z))
now = rospy.Time.now()
later = buffer.lookup_transform_full("map", now, "hand", now, "base", rospy.Duration(30))
gap = later.header.stamp - now  # the genuine library rounds timestamps
print(abs(gap.to_sec()) < 1e-6, round(later.transform.translation.z, 6))
point = PointStamped()
point.header.frame_id = "hand"
point.point.x = 1.0
print(round(buffer.transform(point, "map").point.x, 6))
try:
    buffer.lookup_transform("map", "nowhere", rospy.Time(0), rospy.Duration(0.1))
except tf2_ros.LookupException as error:
    print(error)
old = tf.TransformListener()
old.waitForTransform("/map", "/hand", rospy.Time(0), rospy.Duration(30))
print(old.lookupTransform("/map", "/hand", rospy.Time(0))[0])
frames = yaml.safe_load(rospy.ServiceProxy("/asker/tf2_frames", FrameGraph)().frame_yaml)
print(sorted((name, frame["parent"], frame["broadcaster"]) for name, frame in frames.items()))
