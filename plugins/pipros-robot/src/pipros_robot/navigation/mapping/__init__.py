"""Build maps from laser scans by grid-based FastSLAM with scan matching, as in slam_gmapping. Needs numpy.

`hit_maps.py`, `matching.py`, `slam.py` and `survey.py` perform no I/O; `gmapping_node.py` connects them to
topics and transforms. All poses are the laser's: x, y in metres and yaw in radians. The modules cite
G. Grisetti, C. Stachniss and W. Burgard, Improved Techniques for Grid Mapping With Rao-Blackwellized Particle
Filters, IEEE Transactions on Robotics 23 (2007).
"""
