"""Bags of ROS 2 (MCAP and SQLite): reading them as bags of ROS 1, and writing them."""
