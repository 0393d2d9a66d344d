"""Interface definitions of ROS 2: their language, their type hashes, and the types that pipros knows."""
