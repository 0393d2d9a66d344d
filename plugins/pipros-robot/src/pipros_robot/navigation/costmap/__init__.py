"""Costmaps around a robot, as in costmap_2d. Start with `layered.py` (no I/O) and `costmap.py` (topics).

Costs are 0 (free) to 252 near obstacles, 253 if a robot with its centre in the cell certainly collides, 254
for obstacles, and 255 if unknown. Positions are in metres and angles in radians, in the map's frame.
"""
