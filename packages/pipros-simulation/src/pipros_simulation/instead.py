"""Packages that the simulated robots replace; `pipros.packages.well_known` suggests the replacements."""

_SIMULATOR = "roslaunch pipros_sim sim.launch simulates robots with cmd_vel, odom and scan in a flat world."
_MAPPING = (
    "rosrun gmapping slam_gmapping builds maps, also with the simulator: roslaunch pipros_sim sim.launch."
)
INSTEAD = {
    **dict.fromkeys(("gazebo", "gazebo_ros", "husky_gazebo", "turtlebot3_gazebo"), _SIMULATOR),
    **dict.fromkeys(("hector_mapping", "hector_slam_launch"), _MAPPING),
}
"""Replacements for packages that courses use in their exercises."""
