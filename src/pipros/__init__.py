"""ROS 1 from pip: master, client, messages, launch and tools, with no ROS installation.

Importing this package costs nothing: every part is imported where it is used.
"""

__version__ = "0.1.0"
