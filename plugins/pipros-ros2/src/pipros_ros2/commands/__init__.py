"""The command `pipros ros2`, and ROS 2 bags for `rosbag`."""
