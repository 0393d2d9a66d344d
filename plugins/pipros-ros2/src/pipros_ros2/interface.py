"""Interface of a connection to ROS 2, independent of the middleware.

An engine transports bytes: payloads are CDR with the encapsulation header. Names and types are in
ROS 2 form (`/chatter`, `std_msgs/msg/String`), and an engine translates them to DDS or Zenoh. It does not
convert messages.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from pipros.basics.errors import PiprosError

ROS2_CALLS = 64
"""Limit: calls or goals that a gateway forwards at a time to or from one ROS 2 service or action. Beyond it,
further calls to ROS 2 fail at once, further goals are queued, and requests from ROS 2 are queued or refused;
a ROS 1 node or ROS 2 client gets at most half of what the others leave, except ROS 2 clients with rclpy.
"""
ZENOH_MESSAGE_BYTES = 64 * 1024 * 1024
"""Limit: a message from ROS 2 through Zenoh; also a message that contains all static transforms. Beyond it,
the message is dropped.
"""
ROS2_HISTORY_BYTES = 256 * 1024 * 1024
"""Limit: the messages that one writer keeps for ROS 2 readers; also the latched messages of a ROS 2 topic,
and the results of a ROS 1 action. Beyond it, the oldest message is dropped, and counted for each reader that
has not received it; a message larger than the limit is refused; the oldest finished goals of an action are
forgotten with their results.
"""


class Reliability(Enum):
    """Reliability policy: whether lost messages are sent again. The values are ROS 2 names."""

    RELIABLE = "reliable"
    BEST_EFFORT = "best_effort"


class Durability(Enum):
    """Durability policy: whether late subscribers receive earlier messages. The values are ROS 2 names."""

    VOLATILE = "volatile"
    TRANSIENT_LOCAL = "transient_local"


@dataclass(frozen=True, slots=True)
class TopicQos:
    """The QoS policies that gateways set. All other policies have the ROS 2 defaults.

    Attributes:
        depth: number of messages that are kept; 0 keeps all, within the limits of the engine.
    """

    reliability: Reliability = Reliability.RELIABLE
    durability: Durability = Durability.VOLATILE
    depth: int = 10


class EndpointKind(Enum):
    """The role of an endpoint."""

    PUBLISHER = "publisher"
    SUBSCRIBER = "subscriber"
    SERVER = "server"
    CLIENT = "client"


@dataclass(frozen=True, slots=True)
class Endpoint:
    """An endpoint of another process.

    Attributes:
        key: identifies the endpoint within the engine.
        node: full name of its node; empty if unknown.
        type_hash: the announced hash; empty for Humble, which announces none.
        gateway: identity of the gateway that offers the endpoint for ROS 1; empty for other endpoints.
        problem: why a server cannot be called; otherwise empty.
        process: identifies its process within the engine; empty if unknown.
    """

    key: bytes
    kind: EndpointKind
    name: str
    type: str
    type_hash: str = ""
    qos: TopicQos = TopicQos()
    node: str = ""
    gateway: str = ""
    problem: str = ""
    process: str = ""


@dataclass(frozen=True, slots=True)
class EngineProblem:
    """A topic that cannot be exchanged with a peer, or a node of this engine that peers do not list.

    Attributes:
        kind: role of the peer's endpoint; None for a node of this engine.
        name: name of the topic or node.
        node: name of the peer's node, its GUID if the name is unknown, or empty.
    """

    kind: EndpointKind | None
    name: str
    reason: str
    node: str = ""


@dataclass(frozen=True, slots=True)
class Sample:
    """A message from ROS 2. `publisher` is the key of the endpoint that sent it."""

    payload: bytes | memoryview
    publisher: bytes = b""


GATEWAY_NODE = "ros1_gateway_"
"""Prefix of the node names of gateways; the gateway's identity follows."""


def gateway_of_node(node: str) -> str:
    """Return the identity of the gateway that owns a node, or an empty string for other nodes.

    >>> gateway_of_node("/ros1_gateway_ab_12")
    'ab_12'
    """
    name = node.rpartition("/")[2]
    return name[len(GATEWAY_NODE) :] if name.startswith(GATEWAY_NODE) else ""


class EngineError(PiprosError):
    """A connection to ROS 2 cannot be opened, or an endpoint cannot be created."""


class Ros2CallFailed(EngineError):
    """A ROS 2 service is not available, or did not answer in time."""


class Ros2Subscription(Protocol):
    """A subscriber or a service server that an engine has created."""

    @property
    def dropped(self) -> int:
        """Number of messages or requests that were refused, or lost before they reached the callback."""

    def close(self) -> None:
        """Close the endpoint. No callback starts afterwards. May be called repeatedly."""


class Ros2Publisher(Protocol):
    """A publisher that an engine has created. Thread-safe."""

    def publish(self, payload: bytes) -> None:
        """Send CDR data without waiting.

        A reliable subscriber that is more than `depth` messages behind loses messages.

        Raises:
            PiprosError: the engine is closed, or the payload exceeds a limit. Engines need not detect either.
        """

    @property
    def subscriber_count(self) -> int:
        """Number of matched subscribers in other processes."""

    @property
    def dropped(self) -> int:
        """Number of messages known to be lost because a subscriber or the network was too slow."""

    def close(self) -> None: ...


class Ros2Caller(Protocol):
    """A service client that an engine has created. Thread-safe."""

    def call(self, request: bytes, timeout_s: float) -> bytes:
        """Return the reply.

        Raises:
            Ros2CallFailed: no server is available, or the call timed out.
        """

    @property
    def is_available(self) -> bool:
        """Whether a server is available."""

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class PartHashes:
    """The type hashes of a service's request and response, which DDS endpoints announce."""

    request: str = ""
    response: str = ""


NO_HASHES = PartHashes()


class Ros2Engine(Protocol):
    """A connection to the nodes of one domain. Thread-safe.

    Callbacks run in threads of the engine, one at a time for each subscription. `type_hash` is empty for
    Humble. Creating an endpoint raises PiprosError if the engine is closed or the name is not legal in ROS 2.
    """

    def advertise(self, topic: str, type_name: str, type_hash: str, qos: TopicQos) -> Ros2Publisher:
        """Create a publisher, and announce it to the peers."""

    def subscribe(
        self,
        topic: str,
        type_name: str,
        type_hash: str,
        qos: TopicQos,
        callback: Callable[[Sample], None],
    ) -> Ros2Subscription:
        """Create a subscriber."""

    def serve(
        self,
        service: str,
        type_name: str,
        type_hash: str,
        answer: Callable[[bytes], bytes | None],
        parts: PartHashes = NO_HASHES,
    ) -> Ros2Subscription:
        """Offer a service. ROS 2 has no error replies: the client gets none if `answer` returns None, which
        reports why itself, or raises, which the engine reports.

        `answer` runs in threads of the engine, up to `ROS2_CALLS` at a time for each service.
        """

    def caller(
        self, service: str, type_name: str, type_hash: str, parts: PartHashes = NO_HASHES
    ) -> Ros2Caller:
        """Create a service client."""

    def lacks(self, type_name: str) -> str:
        """Return why services of a type cannot be offered or called; empty if they can."""

    def endpoints(self) -> Sequence[Endpoint]:
        """Return the known endpoints of other processes."""

    def problems(self) -> Sequence[EngineProblem]:
        """Return known communication problems with peers, such as subscribers with an incompatible QoS."""

    def close(self) -> None:
        """Close all endpoints, stop the threads and notify the peers. May be called repeatedly."""
