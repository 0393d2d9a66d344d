"""Simulator of robots with two wheels in a flat world.

Robots receive `cmd_vel`, and publish odometry, transforms, laser scans and the state of their battery.

Start with `simulation.py`, which is pure; `robots_node.py` connects it to topics and services. Needs numpy.
"""

from pipros.basics.errors import MissingExtra
from pipros.basics.extras import install_command

try:
    import numpy as numpy  # the import error is raised here for all modules of the package
except ImportError as error:
    raise MissingExtra(
        f"the simulator of robots needs numpy, which is not installed. Try: {install_command('numpy')}",
        name=error.name,
    ) from error
