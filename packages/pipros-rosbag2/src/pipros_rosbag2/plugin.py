"""The declaration of ROS 2 bags; see `pipros.basics.plugins`."""

from pipros.basics.plugins import Plugin

PLUGIN = Plugin(
    "rosbag2",
    "ROS 2 bags",
    offers={
        "bags": "pipros_rosbag2.commands",
        "ros2_package": "pipros_rosbag2.interfaces.package:ros2_package",
    },
)
