"""State machine of rosbridge v2 for one client: bytes and text in, effects out.

Performs no I/O. Not thread-safe. An effect that fails is thrown into the generator that yielded it; then its
operation has changed nothing, and the client gets an error.

Clients rely on the following rules. An id of any JSON type is returned unchanged. A failed `call_service` is
answered with a `service_response`; all other errors are reported as `status` operations of level `error`,
unless the client has turned off this level with `set_level`. If a client subscribes to a topic several times,
the highest-ranking encoding, the shortest throttle interval, the shortest queue and the smallest fragments
apply.

Source of the protocol: https://github.com/RobotWebTools/rosbridge_suite/blob/develop/ROSBRIDGE_PROTOCOL.md
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

from pipros.basics.errors import InvalidName, PiprosError
from pipros.basics.limits import Limits, process_limits
from pipros_bridges.rosapi import QUESTIONS
from pipros_bridges.rosbridge.effects import (
    Advertise,
    AnswerCall,
    CallService,
    DeliveryOptions,
    Disconnect,
    Effect,
    LeaveTopic,
    OfferService,
    Publish,
    Reply,
    TakeTopic,
    Unadvertise,
    WithdrawService,
)
from pipros_bridges.rosbridge.encoding import WireEncoding, check_codec
from pipros_bridges.rosbridge.globs import Globs
from pipros_bridges.rosbridge.operation_fields import (
    BadOperation,
    cost_of_id,
    cost_of_name,
    flag_in,
    key_of,
    number_in,
    quoted,
    type_in,
)
from pipros_bridges.rosbridge.operation_reader import OperationReader
from pipros_bridges.rosbridge.settings import RosbridgeSettings
from pipros_bridges.rosbridge.text_input import BadInput
from pipros_bridges.shares import BRIDGE_SUBSCRIPTIONS, ClientShares, ExceedsShare, ServerShares

QUEUE_SIZE = 100
"""Queue size of a publisher, unless the client specifies it."""

Effects = Generator[Effect, None, None]
_OF_ROS_2 = frozenset(
    (
        *("advertise_action", "unadvertise_action", "send_action_goal", "cancel_action_goal"),
        *("action_feedback", "action_result", "action_status"),
    )
)

_HARMLESS = frozenset(
    (
        *("subscribe", "unsubscribe", "unadvertise", "unadvertise_service"),
        *("service_response", "set_level", "auth"),
    )
)
"""Operations that do not change the system."""
QUESTION_NAMES = frozenset(f"/rosapi/{name}" for name in QUESTIONS)
"""Services that do not change the system."""


class Level(IntEnum):
    """Severity of a `status` operation."""

    NONE = 0
    ERROR = 1
    WARNING = 2
    INFO = 3


@dataclass(slots=True)
class _TopicState:
    """The client's subscriptions to one topic, keyed by id."""

    kind: str | None
    requests: dict[str, DeliveryOptions] = field(default_factory=dict)

    def delivery(self) -> DeliveryOptions:
        requests = self.requests.values()
        return DeliveryOptions(
            max(request.encoding for request in requests),
            min(request.throttle_s for request in requests),
            min(request.queue_length for request in requests),
            min((request.fragment_size for request in requests if request.fragment_size), default=0),
        )


class ClientProtocol:
    """The state of one client.

    Attributes:
        is_authenticated: whether the client may use operations other than `auth`.
        operations: the function that handles each operation, besides `fragment`.
    """

    def __init__(
        self,
        settings: RosbridgeSettings,
        resolve: Callable[[str], str],
        limits: Limits | None = None,
        clock_s: Callable[[], float] = time.monotonic,
        shares: ClientShares | None = None,
        check_type: Callable[[str, str], object] = lambda *_: None,
    ) -> None:
        """Create the initial state. `resolve` returns a name's global form, or raises `InvalidName`.

        `check_type` raises `PiprosError` if a topic is published with another type; it may block.
        """
        self._shares = shares or ServerShares(limits or process_limits()).client(
            is_reader=not settings.has_control
        )
        self._settings = settings
        self._resolve = resolve
        self._check_type = check_type
        self._max_names = BRIDGE_SUBSCRIPTIONS
        self.is_authenticated = settings.authenticator is None
        self._level = Level.ERROR
        self._reader = OperationReader(
            self._shares, settings.fragment_timeout_s, clock_s, is_bson=settings.is_bson
        )
        self._topics: dict[str, _TopicState] = {}
        self._advertised: dict[str, set[str]] = {}
        self._offered: set[str] = set()
        self.operations: Mapping[str, Callable[[dict[str, Any]], Iterator[Effect]]] = {
            "advertise": self._advertise,
            "unadvertise": self._unadvertise,
            "publish": self._publish,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "call_service": self._call_service,
            "advertise_service": self._advertise_service,
            "unadvertise_service": self._unadvertise_service,
            "service_response": self._service_response,
            "set_level": self._set_level,
            "auth": self._auth,
        }

    def receive(self, data: str | bytes) -> Effects:
        """Return a generator that processes a frame and yields its effects; see `OperationReader.read`."""
        return self._handle_all(self._reader.read(data))

    def receive_stream(self, text: str) -> Effects:
        """Like `receive`, but for the next part of a stream of JSON objects."""
        return self._handle_all(self._reader.read_stream(text))

    def _handle_all(self, operations: Iterator[dict[str, Any] | BadInput]) -> Effects:
        for operation in operations:
            if isinstance(operation, BadInput):
                yield from self.status(Level.ERROR, str(operation))
            else:
                yield from self._handle(operation)

    def end_message(self) -> int:
        """Give back the memory that is counted for the current message, and return its size."""
        return self._reader.end_message()

    @property
    def parsed_bytes(self) -> int:
        """Approximate memory of the message that is being handled; 0 for a short one."""
        return self._reader.parsed_bytes

    @property
    def incomplete_bytes(self) -> int:
        """Memory of the incomplete text at the end of a stream."""
        return self._reader.incomplete_bytes

    def status(self, level: Level, text: str, operation: Mapping[str, Any] | None = None) -> Iterator[Reply]:
        """Yield a `status` operation, unless the client has turned off its level."""
        if level <= self._level:
            identity = (operation or {}).get("id")
            status = {"op": "status", "level": level.name.lower(), "msg": text}
            yield Reply(status if identity is None else {**status, "id": identity})

    def no_response(self, operation: Mapping[str, Any], text: str) -> Reply:
        """Return the response to a failed `call_service`."""
        return Reply(response_to(operation, text, is_success=False))

    def _handle(self, operation: dict[str, Any], *, is_joined: bool = False) -> Iterator[Effect]:
        name = operation.get("op")
        if not self.is_authenticated and name != "auth":
            yield Disconnect("the first operation must be auth")
            return
        handle = self.operations.get(name) if isinstance(name, str) else None
        try:
            if name == "fragment" and not is_joined:
                whole = self._reader.join(operation)
                if whole is not None:
                    yield from self._handle(whole, is_joined=True)
                return
            if handle is None:
                hint = ": actions are for ROS 2" if isinstance(name, str) and name in _OF_ROS_2 else ""
                raise BadOperation(f"unknown operation {quoted(name)}{hint}")
            if not self._settings.has_control:
                _check_changes_nothing(operation)
            yield from handle(operation)
        except ExceedsShare as error:
            yield Disconnect(str(error))
        except (PiprosError, RecursionError) as error:
            if name == "call_service":
                yield self.no_response(operation, str(error))
            else:
                yield from self.status(Level.ERROR, f"{name if handle else quoted(name)}: {error}", operation)

    # -- topics ---------------------------------------------------------------------------

    def _subscribe(self, operation: dict[str, Any]) -> Iterator[Effect]:
        topic = self._name(operation, "topic", self._settings.topics)
        kind = type_in(operation) if operation.get("type") is not None else None
        request = DeliveryOptions(
            WireEncoding.of(operation.get("compression")),
            max(number_in(operation, "throttle_rate", least=-math.inf), 0) / 1000,
            int(number_in(operation, "queue_length")),
            int(number_in(operation, "fragment_size")),
        )
        check_codec(request.encoding)
        key = key_of(operation)
        known = self._topics.get(topic)
        if known is None:
            self._check_limit(self._topics, "subscriptions")
            known = _TopicState(kind)
        elif kind is not None and known.kind is not None and kind != known.kind:
            raise BadOperation(f"this client subscribes to {topic} with the type {known.kind}, not {kind}")
        elif kind is not None and known.kind is None:
            self._check_type(topic, kind)  # the first subscription goes on, with any type
        if known.requests.get(key) == request:
            return
        after = _TopicState(known.kind, {**known.requests, key: request})
        cost = cost_of_id(key) + (0 if topic in self._topics else cost_of_name(topic))
        with self._keeping(known.requests, key, f"subscriptions to {topic}", cost):
            yield TakeTopic(topic, after.kind, after.delivery(), operation)
        self._topics[topic] = after

    def _unsubscribe(self, operation: dict[str, Any]) -> Iterator[Effect]:
        topic = self._name(operation, "topic")
        known = self._topics.get(topic)
        if known is None:
            return
        key = key_of(operation)
        gone = list(known.requests) if operation.get("id") is None else [key] if key in known.requests else []
        for each in gone:
            del known.requests[each]
            self._shares.release(cost_of_id(each))
        if not known.requests:
            del self._topics[topic]
            self._shares.release(cost_of_name(topic))
            yield LeaveTopic(topic)
        elif gone:
            yield TakeTopic(topic, known.kind, known.delivery(), operation)

    def _advertise(self, operation: dict[str, Any]) -> Iterator[Effect]:
        topic = self._name(operation, "topic", self._settings.topics)
        kind = type_in(operation)
        latch = flag_in(operation, "latch") or False
        queue_size = int(number_in(operation, "queue_size", QUEUE_SIZE))
        key = key_of(operation)
        if topic not in self._advertised:
            self._check_limit(self._advertised, "advertised topics")
        ids = self._advertised.get(topic, set())
        cost = cost_of_id(key) + (0 if ids else cost_of_name(topic))
        with self._keeping(ids, key, f"advertisements of {topic}", cost):
            yield Advertise(topic, kind, latch, queue_size, operation)
        self._advertised[topic] = ids | {key}

    def _unadvertise(self, operation: dict[str, Any]) -> Iterator[Effect]:
        topic = self._name(operation, "topic")
        key = key_of(operation)
        ids = self._advertised.get(topic, set())
        for each in list(ids) if operation.get("id") is None else [key] if key in ids else []:
            ids.remove(each)
            self._shares.release(cost_of_id(each))
        if topic in self._advertised and not ids:
            del self._advertised[topic]
            self._shares.release(cost_of_name(topic))
            yield Unadvertise(topic)

    def _publish(self, operation: dict[str, Any]) -> Iterator[Effect]:
        topic = self._name(operation, "topic", self._settings.topics)
        values = operation.get("msg", {})
        if not isinstance(values, (dict, list)):
            # For many topics an empty message is a command, such as a velocity of zero.
            raise BadOperation(f"msg must be an object, got {quoted(values)}")
        latch, queue_size = flag_in(operation, "latch"), int(number_in(operation, "queue_size", QUEUE_SIZE))
        cost = cost_of_name(topic) + cost_of_id("null")
        with self._keeping(self._advertised, topic, "advertised topics", cost):
            yield Publish(topic, values, latch, queue_size, operation)
        self._advertised.setdefault(topic, {"null"})

    # -- services -------------------------------------------------------------------------

    def _call_service(self, operation: dict[str, Any]) -> Iterator[Effect]:
        # As in rosbridge, a number after `#` only distinguishes calls.
        service = self._name(operation, "service", self._settings.services, end="#")
        fragment_size = int(number_in(operation, "fragment_size"))
        yield CallService(service, operation.get("args"), fragment_size, operation)

    def _advertise_service(self, operation: dict[str, Any]) -> Iterator[Effect]:
        service, kind = self._name(operation, "service", self._settings.services), type_in(operation)
        with self._keeping(self._offered, service, "offered services", cost_of_name(service)):
            yield OfferService(service, kind, operation)
        self._offered.add(service)

    def _unadvertise_service(self, operation: dict[str, Any]) -> Iterator[Effect]:
        service = self._name(operation, "service")
        if service not in self._offered:
            raise BadOperation(f"this client does not offer {service}")
        self._offered.discard(service)
        self._shares.release(cost_of_name(service))
        yield WithdrawService(service)

    def _service_response(self, operation: dict[str, Any]) -> Iterator[Effect]:
        service = self._name(operation, "service")
        if service not in self._offered:
            raise BadOperation(f"this client does not offer {service}")
        is_success = flag_in(operation, "result") is not False
        yield AnswerCall(service, operation.get("id"), operation.get("values"), is_success, operation)

    # -- the connection ---------------------------------------------------------------------

    def _set_level(self, operation: dict[str, Any]) -> Iterator[Effect]:
        known = [level.name.lower() for level in Level]
        if operation.get("level") not in known:
            raise BadOperation(
                f"level must be one of {', '.join(known)}; got {quoted(operation.get('level'))}"
            )
        self._level = Level(known.index(operation["level"]))
        yield from ()

    def _auth(self, operation: dict[str, Any]) -> Iterator[Effect]:
        authenticator = self._settings.authenticator
        if self.is_authenticated or authenticator is None:
            return
        if authenticator.accepts(operation):
            self.is_authenticated = True
        else:
            yield Disconnect("authentication failed")

    # -- fields of operations -------------------------------------------------------------

    def _name(
        self, operation: Mapping[str, Any], key: str, globs: Globs | None = None, end: str | None = None
    ) -> str:
        """Return the name in a field, up to `end`. Raise `BadOperation` if it is invalid or not allowed."""
        name = operation.get(key)
        if isinstance(name, str) and end is not None:
            name = name.partition(end)[0]
        if not isinstance(name, str) or not name:
            raise BadOperation(f"{key} must be a name, got {quoted(name)}")
        try:
            resolved = self._resolve(name)
        except InvalidName as error:
            raise BadOperation(str(error)) from None
        if globs is not None and not globs.allow(resolved):
            raise BadOperation(f"clients may not use {resolved}; they may use {', '.join(globs.patterns)}")
        return name

    def _keeping(self, known: Any, key: str, what: str, size_bytes: int) -> AbstractContextManager[None]:
        """Return the context of an effect that adds a key, which is not counted if the effect fails."""
        if key in known:
            return nullcontext()
        self._check_limit(known, what)
        return self._shares.keeping(size_bytes)

    def _check_limit(self, known: Any, what: str) -> None:
        if len(known) >= self._max_names:
            raise BadOperation(f"too many {what}; the limit is {self._max_names}")


def _check_changes_nothing(operation: Mapping[str, Any]) -> None:
    """Raise `BadOperation` if an operation would change the system."""
    service = operation.get("service")
    is_question = operation["op"] == "call_service" and isinstance(service, str) and service in QUESTION_NAMES
    if operation["op"] not in _HARMLESS and not is_question:
        raise BadOperation("this server is read-only; its option --control allows changes")


def response_to(operation: Mapping[str, Any], values: Any, *, is_success: bool) -> dict[str, Any]:
    """Return the `service_response` operation for a `call_service`."""
    response = {"op": "service_response", "service": operation.get("service"), "values": values}
    response["result"] = is_success
    return response if operation.get("id") is None else {**response, "id": operation["id"]}
