"""Monte Carlo localisation on a known map, as in amcl. Needs numpy and OpenCV.

`sensors.py` and `particles.py` contain the models and the particle filter, and `localizer.py`
decides when to use them. None of these modules performs I/O. `amcl_node.py` connects them to topics, services
and transforms. Poses are x, y in metres and yaw in radians. The modules cite Thrun, Burgard and Fox,
Probabilistic Robotics (2005).
"""
