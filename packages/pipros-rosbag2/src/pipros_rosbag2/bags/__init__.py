"""Read ROS 2 bags (MCAP and SQLite) as ROS 1 bags, and write ROS 2 bags."""
