"""Drop-in replacement for Noetic's tf2_sensor_msgs: registers a function that transforms point clouds."""

from sensor_msgs.msg import PointCloud2 as PointCloud2

from pipros.basics.lazy_names import star_names as _star_names
from tf2_sensor_msgs.tf2_sensor_msgs import create_cloud as create_cloud
from tf2_sensor_msgs.tf2_sensor_msgs import do_transform_cloud as do_transform_cloud
from tf2_sensor_msgs.tf2_sensor_msgs import from_msg_msg as from_msg_msg
from tf2_sensor_msgs.tf2_sensor_msgs import read_points as read_points
from tf2_sensor_msgs.tf2_sensor_msgs import to_msg_msg as to_msg_msg
from tf2_sensor_msgs.tf2_sensor_msgs import transform_to_kdl as transform_to_kdl

_star_names(__name__, "PyKDL rospy tf2_ros")
