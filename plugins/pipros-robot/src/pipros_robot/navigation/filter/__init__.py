"""Estimate a robot's state from several sensors with Kalman filters, as in robot_localization. Needs numpy.

`kalman.py` and `unscented.py` are the filters, `timeline.py` orders measurements by time, `measurements.py`
derives measurements from poses, twists and accelerations; none of them performs I/O. `filter_node.py`
connects them to topics, services and transforms.
"""
