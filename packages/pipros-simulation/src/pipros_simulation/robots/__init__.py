"""A simulator of two-wheeled robots in a flat world. It needs numpy.

Robots receive `cmd_vel`, and publish odometry, transforms, laser scans and their battery's state.
`simulation.py` performs no I/O; `robots_node.py` connects it to topics and services.
"""

from pipros.basics.extras import missing

try:
    import numpy as numpy  # the import error is raised here for all modules in the package
except ImportError as error:
    raise missing("the robot simulator needs numpy", "numpy", error) from error
