"""Build wheels of ROS packages, install them with pip or uv, and write indexes of them."""
