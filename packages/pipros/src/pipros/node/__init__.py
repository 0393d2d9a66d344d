"""ROS nodes: topics, services, parameters, time and logs."""

from pipros.node.node import Node
from pipros.node.publisher import Publisher
from pipros.node.subscriber import Subscriber

__all__ = ["Node", "Publisher", "Subscriber"]
