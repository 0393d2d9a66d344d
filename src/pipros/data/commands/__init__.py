"""The subcommands of `rosbag` that read bags as tables."""
