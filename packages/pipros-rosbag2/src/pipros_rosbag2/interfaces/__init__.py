"""ROS 2 interface definitions: their language, their type hashes, and the bundled types."""
