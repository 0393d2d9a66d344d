"""Drop-in replacement for Noetic's tf2_geometry_msgs: transforms of geometry_msgs messages."""

from geometry_msgs.msg import PointStamped as PointStamped
from geometry_msgs.msg import PoseStamped as PoseStamped
from geometry_msgs.msg import Vector3Stamped as Vector3Stamped
from geometry_msgs.msg import WrenchStamped as WrenchStamped

from pipros.basics.lazy_names import star_names as _star_names
from tf2_geometry_msgs.tf2_geometry_msgs import do_transform_point as do_transform_point
from tf2_geometry_msgs.tf2_geometry_msgs import do_transform_pose as do_transform_pose
from tf2_geometry_msgs.tf2_geometry_msgs import do_transform_vector3 as do_transform_vector3
from tf2_geometry_msgs.tf2_geometry_msgs import do_transform_wrench as do_transform_wrench
from tf2_geometry_msgs.tf2_geometry_msgs import from_msg_msg as from_msg_msg
from tf2_geometry_msgs.tf2_geometry_msgs import to_msg_msg as to_msg_msg
from tf2_geometry_msgs.tf2_geometry_msgs import transform_to_kdl as transform_to_kdl

_star_names(__name__, "copy PyKDL rospy tf2_ros")
