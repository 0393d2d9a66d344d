"""The services of `mux` and `demux`, and the topic on which they publish the selection."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import rospy
from pipros.msg import load_message_class, load_service_class
from pipros_libraries.topic_tools.selection import NONE, BadSelection, Selection


def resolved(topic: str) -> str:
    """Return the global name of the topic in a service request; `__none` is returned unchanged."""
    return topic if topic == NONE else rospy.resolve_name(topic)


def selection_of(tool: str, topics: Iterable[str]) -> Selection:
    """Return a selection with the first of the topics selected. Raises SystemExit if a topic is refused."""
    selection = Selection([], tool)
    try:
        for topic in dict.fromkeys(map(rospy.resolve_name, topics)):
            selection.add(topic)
    except BadSelection as error:
        raise SystemExit(str(error)) from None
    selection.select(selection.topics[0])
    return selection


class Services:
    """The services of a mux or demux, and the latched topic `selected`."""

    def __init__(self, kind: str, selection: Selection) -> None:
        """Advertise `selected`. `kind` is `Mux` or `Demux`; its lower case is the namespace."""
        self._kind = kind
        self._selection = selection
        self._namespace = rospy.resolve_name(kind.lower())
        self._text: Any = load_message_class("std_msgs/String")
        self._selected = rospy.Publisher(f"{self._namespace}/selected", self._text, queue_size=1, latch=True)

    def serve(self, verb: str, act: Callable[[str], object], name: str | None = None) -> None:
        """Serve `Add`, `Delete` or `Select`, calling `act` with the topic.

        If `act` raises `BadSelection`, the call fails with the text of the exception. `Select` also publishes
        the selection.
        """
        service: Any = load_service_class(f"topic_tools/{self._kind}{verb}")

        def handle(request: Any) -> Any:
            try:
                result = act(resolved(request.topic))
            except BadSelection as error:
                rospy.logwarn(str(error))
                raise rospy.ServiceException(str(error)) from None
            if verb != "Select":
                return service._response_class()
            self.announce()
            return service._response_class(result)

        rospy.Service(name or f"{self._namespace}/{verb.lower()}", service, handle)

    def serve_list(self) -> None:
        """Serve `List`, which returns all topics that can be selected."""
        service: Any = load_service_class(f"topic_tools/{self._kind}List")
        rospy.Service(
            f"{self._namespace}/list", service, lambda _: service._response_class(self._selection.topics)
        )

    def announce(self) -> None:
        """Publish the name of the selected topic, or `__none`."""
        self._selected.publish(self._text(self._selection.selected or NONE))
