"""The types of topics, and of the fields that stand behind a topic's name: `/scan/ranges`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pipros.errors import NotFound
from pipros.net.master import MasterClient

_PARTS_OF_TIME: Mapping[str, str] = {"secs": "int32", "nsecs": "int32"}


def topic_type(master: MasterClient, name: str) -> tuple[str | None, str]:
    """The type of the topic that `name` starts with, and that topic.

    `/scan/ranges` is the field `ranges` of `/scan`, unless there is a topic `/scan/ranges`.
    Returns `(None, name)` when no such topic has a type yet.
    """
    types = {topic: type_name for topic, type_name in master.get_topic_types() if type_name != "*"}
    topic = name
    while topic:
        if topic in types:
            return types[topic], topic
        topic = topic.rpartition("/")[0]
    return None, name


def field_type(type_name: str, path: Sequence[str]) -> str:
    """The type of a field of a message, nested fields included: `header/stamp` is `time`.

    Raises:
        NotFound: no such field, or no such message type.
    """
    for name in path:
        fields = _fields(type_name)
        if name not in fields:
            raise NotFound(f"{type_name} has no field [{name}]")
        type_name = fields[name]
    return type_name


def _fields(type_name: str) -> Mapping[str, str]:
    if type_name in ("time", "duration"):
        return _PARTS_OF_TIME
    if "/" not in type_name or type_name.endswith("]"):
        return {}
    from pipros.msg import load_message_class

    message_class = load_message_class(type_name)
    return dict(zip(message_class.__slots__, message_class._slot_types, strict=True))
