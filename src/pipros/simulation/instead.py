"""What simulated robots replace; `pipros.packages.well_known` gives this advice."""

_SIMULATOR = "roslaunch pipros_sim sim.launch simulates robots with cmd_vel, odom and scan in a flat world."
_KNOWN_POSES = (
    "roslaunch pipros_sim localized.launch simulates a robot with a map and amcl_pose; it does not map."
)
INSTEAD = {
    **dict.fromkeys(("gazebo", "gazebo_ros", "husky_gazebo", "turtlebot3_gazebo"), _SIMULATOR),
    **dict.fromkeys(
        ("gmapping", "hector_mapping", "hector_slam_launch", "slam_gmapping"),
        _KNOWN_POSES,
    ),
    **dict.fromkeys(("turtlebot3_slam",), _KNOWN_POSES),
}
"""What to use instead of packages that courses use in their exercises."""
