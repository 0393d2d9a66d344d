"""Convert satellite positions to the world frame of a filter, as in navsat_transform_node. Needs numpy.

`geodesy.py` and `alignment.py` perform no I/O; `navsat_node.py` connects them to topics and services.
"""
