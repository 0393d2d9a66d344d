"""Interface ROS 2 definitions: their language, their type hashes, and the types that pipros knows."""
