"""The declaration of the gateway to ROS 2; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room, RoomCommand

_PACKAGES = (
    *("rclpy", "rmw-fastrtps-cpp", "std-msgs", "std-srvs", "sensor-msgs", "geometry-msgs", "nav-msgs"),
    *("diagnostic-msgs", "trajectory-msgs", "visualization-msgs"),
)


def _wheels(distribution: str) -> tuple[str, ...]:
    where = "sys_platform == 'linux' and platform_machine == 'x86_64'"
    return tuple(f"ros-{distribution}-{name}; {where}" for name in _PACKAGES)


ROOM = Room(
    "ros2",
    "the gateway to ROS 2, and ROS 2 bags",
    subcommands={
        "ros2": RoomCommand(
            "pipros.ros2.commands.gateway:main",
            "connect the system to ROS 2 nodes",
            "Connect the system to others",
            "status topics nodes services actions echo hz pub call",
        ),
        "port": RoomCommand(
            "pipros.ros2.commands.port:main",
            "list what becomes what when a rospy node moves to rclpy, and write a draft",
            "Connect the system to others",
        ),
    },
    share=("pipros",),
    limits="pipros.ros2.limits:Ros2Limits",
    check="pipros.ros2.health:CHECK",
    offers={
        "bags": "pipros.ros2.commands.bags",
        "ros2_package": "pipros.ros2.interfaces.package:ros2_package",
    },
    # For rmw_zenoh. The defaults of eclipse-zenoh change between minor versions; xxhash computes GIDs.
    # ROS 2 itself: rclpy, the middleware that it loads, and the packages whose messages ROS 1 also has.
    extras={
        "zenoh": ("eclipse-zenoh>=1.10,<1.11", "xxhash>=3.4"),
        "jazzy": _wheels("jazzy"),
        "kilted": _wheels("kilted"),
    },
)
