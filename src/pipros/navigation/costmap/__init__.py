"""Maps of costs around a robot: costmap_2d. Start with `layered.py` (pure) and `costmap.py` (topics).

A cost is 0 (free) to 252 near obstacles; 253 means that the robot's centre collides there for certain, 254 is
an obstacle, and 255 is unknown. Positions are in metres and angles in radians, in the map's frame.
"""
