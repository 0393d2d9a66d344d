"""Messages that belong to a service or an action: requests, responses, events, goals and feedback.

Recorders store them with the definition of the whole service or action.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from pipros_rosbag2.interfaces.action_types import Ros2Action
from pipros_rosbag2.interfaces.spec import Form, Ros2Field, Ros2Message, Ros2Service, Ros2Type

_PART = re.compile(
    r"(\w+/srv/\w+)_(Request|Response|Event)"
    r"|(\w+/action/\w+?)_(Goal|Result|Feedback|FeedbackMessage|(SendGoal|GetResult)_(Request|Response|Event))",
    re.ASCII,
)


def owner_of(name: str) -> str:
    """Return the service or action to which a message belongs. Return an empty string if there is none.

    >>> owner_of("std_srvs/srv/Trigger_Event")
    'std_srvs/srv/Trigger'
    """
    match = _PART.fullmatch(name)
    return "" if match is None else match[1] or match[3]


def parts_of(owner: Ros2Service | Ros2Action) -> Mapping[str, Ros2Message]:
    """Return all messages that belong to a service or an action, by name."""
    return {each.type: each for each in _parts(owner)}


def _parts(owner: Ros2Service | Ros2Action) -> Iterator[Ros2Message]:
    if isinstance(owner, Ros2Action):
        yield from (owner.goal, owner.result, owner.feedback, owner.feedback_message)
        yield from _parts(owner.send_goal)
        yield from _parts(owner.get_result)
        return
    yield from (owner.request, owner.response)
    at_most_one = (Ros2Type(each.type, Form.BOUNDED, 1) for each in (owner.request, owner.response))
    info = Ros2Type("service_msgs/msg/ServiceEventInfo")
    fields = zip((info, *at_most_one), ("info", "request", "response"), strict=True)
    yield Ros2Message(f"{owner.type}_Event", tuple(Ros2Field(kind, name) for kind, name in fields))
