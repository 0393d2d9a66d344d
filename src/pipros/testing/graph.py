"""Questions that tests ask about the graph: who publishes and who subscribes to a topic."""

from __future__ import annotations

from pipros import names
from pipros.env import Environment
from pipros.net.master import MasterClient

_PUBLISHERS, _SUBSCRIBERS = 0, 1


def is_publisher(topic: str, node: str, caller_id: str) -> bool:
    """True when the master knows `node` as a publisher of `topic`.

    Raises:
        Unreachable: no master answers.
    """
    return _is_registered(_PUBLISHERS, topic, node, caller_id)


def is_subscriber(topic: str, node: str, caller_id: str) -> bool:
    """True when the master knows `node` as a subscriber of `topic`.

    Raises:
        Unreachable: no master answers.
    """
    return _is_registered(_SUBSCRIBERS, topic, node, caller_id)


def _is_registered(kind: int, topic: str, node: str, caller_id: str) -> bool:
    environment = Environment.from_os()
    # Both are names of a program without a node of its own: relative to ROS_NAMESPACE and nothing else.
    here = names.join(environment.namespace, caller_id.strip("/"))
    topic, node = names.resolve(topic, here), names.resolve(node, here)
    master = MasterClient(environment.master_uri, caller_id)
    try:
        registered = dict(master.get_system_state()[kind])
    finally:
        master.close()
    return node in registered.get(topic, ())
