"""The types of topics, and of the fields that stand behind a topic's name: `/scan/ranges`."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.errors import NotFound
from pipros.net.master import MasterClient


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
    from pipros.cli.rostopic.fields import fields_of

    for name in path:
        fields = fields_of(type_name)
        if name not in fields:
            raise NotFound(f"{type_name} has no field [{name}]")
        type_name = fields[name]
    return type_name
