"""ROS 2 bags, the definitions of ROS 2 types, and conversions of messages."""
