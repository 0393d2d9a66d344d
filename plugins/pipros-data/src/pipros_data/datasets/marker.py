"""Convert service calls to messages that mark episodes, for `rosbag record`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pipros.msg import load_message_class, load_service_class
from pipros.node import Node

if TYPE_CHECKING:
    from std_msgs.msg import String


class EpisodeMarker:
    """Two services, `TOPIC/start` and `TOPIC/stop` (`std_srvs/Trigger`), that publish strings on TOPIC.

    A call to `start` publishes the value of the parameter `TOPIC/task`, or `episode` if it is not set. A call
    to `stop` publishes an empty string. The last message is latched, so a recording that begins during an
    episode contains its start. Messages on TOPIC have the type `std_msgs/String`.
    """

    def __init__(self, node: Node, topic: str) -> None:
        text: type[String] = load_message_class("std_msgs/String")
        service: Any = load_service_class("std_srvs/Trigger")
        publisher = node.advertise(topic, text, latch=True)

        def start(_: object) -> object:
            try:
                task = str(node.params.get(f"{topic}/task"))
            except LookupError:
                task = "episode"
            publisher.publish(text(task))
            return service._response_class(True, task)

        def stop(_: object) -> object:
            publisher.publish(text(""))
            return service._response_class(True, "")

        node.serve(f"{topic}/start", service, start)
        node.serve(f"{topic}/stop", service, stop)
