"""ROS nodes: topics, services, parameters, time and logs."""

from typing import TYPE_CHECKING

import pipros.basics.light_asyncio  # noqa: F401 # before modules that import asyncio
from pipros.basics.lazy_names import lazy_names
from pipros.node.node import Node
from pipros.node.publisher import Publisher

if TYPE_CHECKING:
    from pipros.node.subscriber import Subscriber

__all__ = ["Node", "Publisher", "Subscriber"]

if not TYPE_CHECKING:  # with __getattr__, type checkers would accept any name
    __getattr__, __dir__ = lazy_names(__name__, {"Subscriber": "pipros.node.subscriber"})
