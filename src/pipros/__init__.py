"""ROS 1 from pip: master, client, messages, launch and tools, with no ROS installation.

Importing this package costs nothing: every part is imported where it is used.

For pytest, which would rewrite the asserts of plugins and warns that this one is imported already (the
import hook is, in every interpreter): PYTEST_DONT_REWRITE
"""

__version__ = "0.1.0"
