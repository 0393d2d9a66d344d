"""Monte Carlo localisation on a known map, as in amcl. Needs numpy and OpenCV.

`motion.py`, `field.py`, `beam.py` and `particles.py` are the models and the particle filter, `localizer.py`
decides when they are used; none of them performs I/O. `amcl_node.py` connects them to topics, services and
transforms. Poses are x, y in metres and yaw in radians. The book that the modules cite is Thrun, Burgard and
Fox, Probabilistic Robotics (2005).
"""
