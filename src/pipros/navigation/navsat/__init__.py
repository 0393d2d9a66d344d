"""Positions of satellite receivers in the world frame of a filter: navsat_transform_node. Needs numpy.

`geodesy.py` and `alignment.py` perform no I/O; `navsat_node.py` connects them to topics and services.
"""

from pipros.navigation.extras import missing_extra

try:
    import numpy as numpy  # the import error is raised here for all modules in the package
except ImportError as error:
    raise missing_extra(error) from error
