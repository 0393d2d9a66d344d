"""Drop-in replacement for Noetic's tf2_kdl: functions that transform PyKDL objects."""

from tf2_kdl.tf2_kdl import convert_vector as convert_vector
from tf2_kdl.tf2_kdl import do_transform_frame as do_transform_frame
from tf2_kdl.tf2_kdl import do_transform_twist as do_transform_twist
from tf2_kdl.tf2_kdl import do_transform_vector as do_transform_vector
from tf2_kdl.tf2_kdl import do_transform_wrench as do_transform_wrench
from tf2_kdl.tf2_kdl import from_msg_vector as from_msg_vector
from tf2_kdl.tf2_kdl import to_msg_vector as to_msg_vector
from tf2_kdl.tf2_kdl import transform_to_kdl as transform_to_kdl
