"""ROS 2 interface definitions: their language, their type hashes, and the types that pipros knows."""
