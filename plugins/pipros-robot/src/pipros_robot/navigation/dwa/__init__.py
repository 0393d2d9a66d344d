"""The dynamic window approach of `dwa_local_planner`: simulate many velocities, and choose the best.

D. Fox, W. Burgard and S. Thrun, "The dynamic window approach to collision avoidance", IEEE Robotics &
Automation Magazine, 1997.

Poses are (x, y, yaw) in metres and radians in the frame of the local costmap. Velocities are (x, y, turn) in
m/s and rad/s in the robot's frame. Start with `planner.py`; only `dwa_node.py` uses topics.
"""
