"""The node robot_pose_ekf: a pose from the motions that wheels, an IMU and a camera measure."""
