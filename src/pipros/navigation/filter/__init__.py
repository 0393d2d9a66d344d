"""State estimation from several sensors with Kalman filters, as robot_localization offers it. Needs numpy.

`kalman.py` and `unscented.py` are the filters, `timeline.py` orders measurements by time, `measurements.py`
makes measurements from poses, twists and accelerations; all of them perform no I/O. `filter_node.py` connects
them to topics, services and transforms.
"""
