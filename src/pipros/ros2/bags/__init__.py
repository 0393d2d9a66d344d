"""ROS 2 bags (MCAP and SQLite): reading them as ROS 1 bags, and writing them."""
