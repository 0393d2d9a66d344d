"""The ROS master."""

import pipros.basics.light_asyncio  # noqa: F401 # before modules that import asyncio
