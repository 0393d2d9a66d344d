"""The commands `rosbag table`, `rosbag query` and `pipros dataset`."""
