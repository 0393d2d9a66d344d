"""The declaration of the gateway to ROS 2; see `pipros.basics.plugins`."""

from pipros.basics.plugins import BETA, EXPERIMENTAL, Plugin, PluginCommand

PLUGIN = Plugin(
    "ros2",
    "the gateway to ROS 2",
    subcommands={
        "ros2": PluginCommand(
            "pipros_ros2.commands.gateway:main",
            "connect the system to ROS 2 nodes",
            "Connect the system to others",
            "status topics nodes services actions echo hz pub call",
        ),
        "port": PluginCommand(
            "pipros_ros2.commands.port:main",
            "list what becomes what when a rospy node moves to rclpy, and write a draft",
            "Connect the system to others",
        ),
    },
    limits="pipros_ros2.limits:Ros2Limits",
    check="pipros_ros2.health:CHECK",
    features={
        "topics and services over DDS": BETA,
        "actions over DDS": BETA,
        "rmw_zenoh": EXPERIMENTAL,
        "pipros port": EXPERIMENTAL,
    },
)
