"""A simulator of two-wheeled robots in a flat world. It needs numpy.

Robots receive `cmd_vel`, and publish odometry, transforms, laser scans and their battery's state.
`simulation.py` performs no I/O; `robots_node.py` connects it to topics and services.
"""

from pipros.basics.errors import MissingExtra
from pipros.basics.extras import install_command

try:
    import numpy as numpy  # the import error is raised here for all modules in the package
except ImportError as error:
    raise MissingExtra(
        f"the robot simulator needs numpy, which is not installed. Try: {install_command('numpy')}",
        name=error.name,
    ) from error
