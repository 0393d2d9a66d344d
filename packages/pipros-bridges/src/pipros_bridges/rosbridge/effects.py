"""Effects of a client's operations, which the server carries out.

Names are unresolved, as the client wrote them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pipros_bridges.rosbridge.encoding import WireEncoding


@dataclass(frozen=True, slots=True)
class Reply:
    """Send an operation to the client: a status or a response."""

    operation: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class DeliveryOptions:
    """Options for delivering a topic to a client, shared by all its subscriptions to the topic.

    Attributes:
        throttle_s: minimum time between two messages.
        queue_length: maximum number of messages queued because of throttling or a slow connection; if 0,
            messages within the throttle interval are dropped, and a slow connection's queue is limited only
            in bytes.
        fragment_size: length in characters above which operations are split into fragments; 0 for no limit.
    """

    encoding: WireEncoding = WireEncoding.JSON
    throttle_s: float = 0.0
    queue_length: int = 0
    fragment_size: int = 0


@dataclass(frozen=True, slots=True)
class TakeTopic:
    """Start sending a topic to the client, or change the delivery options."""

    topic: str
    kind: str | None
    delivery: DeliveryOptions
    operation: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class LeaveTopic:
    """Stop sending a topic to the client."""

    topic: str


@dataclass(frozen=True, slots=True)
class Advertise:
    """Advertise a topic, or change whether it is latched."""

    topic: str
    kind: str
    latch: bool
    queue_size: int
    operation: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Unadvertise:
    """Unadvertise a topic, unless another client advertises it."""

    topic: str


@dataclass(frozen=True, slots=True)
class Publish:
    """Publish a message. `latch` is None if the operation does not specify it."""

    topic: str
    values: Any
    latch: bool | None
    queue_size: int
    operation: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class CallService:
    """Call a service, and send the response with the id of the operation."""

    service: str
    arguments: Any
    fragment_size: int
    operation: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class OfferService:
    """Offer a service whose calls the client answers."""

    service: str
    kind: str
    operation: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class WithdrawService:
    """Stop offering a service."""

    service: str


@dataclass(frozen=True, slots=True)
class AnswerCall:
    """Answer a call to a service that the client offers.

    Attributes:
        call: the ID of the call.
        values: the response, or an error text if `is_success` is false.
    """

    service: str
    call: object
    values: Any
    is_success: bool
    operation: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Disconnect:
    """Close the connection."""

    reason: str


Effect = (
    Reply
    | TakeTopic
    | LeaveTopic
    | Advertise
    | Unadvertise
    | Publish
    | CallService
    | OfferService
    | WithdrawService
    | AnswerCall
    | Disconnect
)
