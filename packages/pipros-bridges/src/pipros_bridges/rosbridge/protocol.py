"""State machine of rosbridge v2 for one client: bytes and text in, effects out.

Performs no I/O. Not thread-safe.

Clients rely on the following rules. An id of any JSON type is returned unchanged. A failed `call_service` is
answered with a `service_response`; all other errors are reported as `status` operations of level `error`,
unless the client has turned off this level with `set_level`. If a client subscribes to a topic several times,
the highest-ranking encoding, the shortest throttle interval, the shortest queue and the smallest fragments
apply.

Source of the protocol: https://github.com/RobotWebTools/rosbridge_suite/blob/develop/ROSBRIDGE_PROTOCOL.md
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

from pipros.basics.errors import InvalidName, PiprosError
from pipros.basics.limits import Limits, process_limits
from pipros.basics.printable import printable
from pipros_bridges.rosapi import QUESTIONS
from pipros_bridges.rosbridge.authentication import Authenticator
from pipros_bridges.rosbridge.bson_size import parsed_bson_bytes
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
from pipros_bridges.rosbridge.encoding import WireEncoding, bson_codec, check_codec
from pipros_bridges.rosbridge.globs import Globs
from pipros_bridges.rosbridge.text_input import (
    BadInput,
    Fragments,
    JsonObjects,
    json_object,
    parsed_json_bytes,
)
from pipros_bridges.shares import BRIDGE_SUBSCRIPTIONS, ClientShares, ExceedsShare, ServerShares
from pipros_server.policy.model import Policy

QUEUE_SIZE = 100
"""Queue size of a publisher, unless the client specifies it."""

_OF_ROS_2 = frozenset(
    (
        *("advertise_action", "unadvertise_action", "send_action_goal", "cancel_action_goal"),
        *("action_feedback", "action_result", "action_status"),
    )
)


ID_CHARACTERS = 1_000
"""Maximum length of an id, as JSON, that the server keeps."""
_NAME_BYTES = 1_000
_ID_BYTES = 200
"""Approximate memory for a topic or service (`_NAME_BYTES`) and for an id, besides their characters."""

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


class BadOperation(PiprosError):
    """A client's operation lacks a value, has an invalid value, or is not allowed."""


@dataclass(frozen=True, slots=True)
class RosbridgeSettings:
    """Settings for all clients of a server.

    Attributes:
        topics, services: names that clients may use. rosapi checks the names of parameters.
        authenticator: checks `auth`, which must be the first operation; None to disable authentication.
        has_control: whether clients may publish, call services and offer services. If False, they may
            call only those services of `rosapi` that do not change the system.
        is_bson: whether binary frames are BSON.
        fragment_timeout_s: how long the fragments of an incomplete text are kept.
        policy: restricts what clients may do; None for no policy.
    """

    topics: Globs = field(default_factory=Globs)
    services: Globs = field(default_factory=Globs)
    authenticator: Authenticator | None = None
    has_control: bool = True
    is_bson: bool = False
    fragment_timeout_s: float = 600.0
    policy: Policy | None = None


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
        parsed_bytes: approximate memory of the message that is being handled; 0 for a short one.
    """

    def __init__(
        self,
        settings: RosbridgeSettings,
        resolve: Callable[[str], str],
        limits: Limits | None = None,
        clock_s: Callable[[], float] = time.monotonic,
        shares: ClientShares | None = None,
    ) -> None:
        """Create the initial state. `resolve` returns a name's global form, or raises `InvalidName`."""
        limits = limits or process_limits()
        self._shares = shares or ServerShares(limits).client(is_reader=not settings.has_control)
        self._settings = settings
        self._resolve = resolve
        self._clock_s = clock_s
        self._max_names = BRIDGE_SUBSCRIPTIONS
        self.is_authenticated = settings.authenticator is None
        self.parsed_bytes = 0
        self._level = Level.ERROR
        self._objects = JsonObjects(self._shares.message_bytes, self._shares.input)
        self._fragments = Fragments(
            self._shares.message_bytes, settings.fragment_timeout_s, self._shares.input
        )
        self._topics: dict[str, _TopicState] = {}
        self._advertised: dict[str, set[str]] = {}
        self._offered: set[str] = set()
        self._operations: Mapping[str, Callable[[dict[str, Any]], Iterator[Effect]]] = {
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

    def receive(self, data: str | bytes) -> Iterator[Effect]:
        """Process a frame, and yield the effects of its operations. The frame may be part of a JSON text.

        If a text is incomplete and the next frame is a whole operation, the incomplete text is discarded, and
        an error is reported.
        """
        if isinstance(data, bytes) and self._settings.is_bson:
            yield from self._receive_bson(data)
            return
        try:
            self._begin_parsing(parsed_json_bytes(data))
        except BadInput as error:
            yield from self.status(Level.ERROR, str(error))
            return
        try:
            operation = json_object(data)
        except BadInput:
            yield from self.receive_stream(data if isinstance(data, str) else data.decode(errors="replace"))
            return
        if not self._objects.is_empty and "op" in operation:
            self._objects.clear()
            yield from self.status(Level.ERROR, "the previous text was not complete JSON and was discarded")
        yield from self._handle(operation)

    def receive_stream(self, text: str) -> Iterator[Effect]:
        """Process the next part of a stream of JSON objects, and yield the effects of complete objects."""
        for found in self._objects.feed(text):
            try:
                operation = self._parsed(found) if isinstance(found, str) else None
            except BadInput as error:
                found, operation = error, None
            if operation is None:
                yield from self.status(Level.ERROR, str(found))
            else:
                yield from self._handle(operation)

    def end_message(self) -> int:
        """Give back the memory that is counted for the current message, and return its size."""
        size_bytes = self.parsed_bytes
        self._begin_parsing(0)
        return size_bytes

    def status(self, level: Level, text: str, operation: Mapping[str, Any] | None = None) -> Iterator[Reply]:
        """Yield a `status` operation, unless the client has turned off its level."""
        if level <= self._level:
            identity = (operation or {}).get("id")
            status = {"op": "status", "level": level.name.lower(), "msg": text}
            yield Reply(status if identity is None else {**status, "id": identity})

    def no_response(self, operation: Mapping[str, Any], text: str) -> Reply:
        """Return the response to a failed `call_service`."""
        return Reply(response_to(operation, text, is_success=False))

    def _parsed(self, text: str) -> dict[str, Any]:
        self._begin_parsing(parsed_json_bytes(text))
        return json_object(text)

    def _begin_parsing(self, size_bytes: int) -> None:
        """Reserve memory for a parsed message, replacing the reservation for the previous message.

        Raises:
            BadInput: too little memory is left.
        """
        if not self._shares.parsed.hold(self.parsed_bytes, size_bytes):
            limit = f"the limit is {int(self._shares.parsed.limit)} bytes"
            raise BadInput(f"a message with so many values needs too much memory; {limit}")
        self.parsed_bytes = size_bytes

    @property
    def incomplete_bytes(self) -> int:
        """Memory of the incomplete text at the end of a stream."""
        return self._objects.held_bytes

    def _receive_bson(self, data: bytes) -> Iterator[Effect]:
        bson = bson_codec()
        try:
            self._begin_parsing(parsed_bson_bytes(data, self._shares.parsed.limit))
            operation = bson.decode(data)
        except BadInput as error:
            yield from self.status(Level.ERROR, str(error))
        except (bson.error, ValueError, RecursionError) as error:
            yield from self.status(Level.ERROR, f"not BSON: {printable(error)}")
        else:
            yield from self._handle(operation)

    def _handle(self, operation: dict[str, Any], *, is_joined: bool = False) -> Iterator[Effect]:
        name = operation.get("op")
        if not self.is_authenticated and name != "auth":
            yield Disconnect("the first operation must be auth")
            return
        try:
            if name == "fragment" and not is_joined:
                text = self._fragments.add(operation, self._clock_s())
                if text is not None:
                    yield from self._handle(self._parsed(text), is_joined=True)
                return
            handle = self._operations.get(name) if isinstance(name, str) else None
            if handle is None:
                hint = ": actions are for ROS 2" if isinstance(name, str) and name in _OF_ROS_2 else ""
                raise BadOperation(f"unknown operation {_quoted(name)}{hint}")
            if not self._settings.has_control:
                _check_changes_nothing(operation)
            yield from handle(operation)
        except ExceedsShare as error:
            yield Disconnect(str(error))
        except (PiprosError, RecursionError) as error:
            if name == "call_service":
                yield self.no_response(operation, str(error))
            else:
                yield from self.status(Level.ERROR, f"{_quoted(name)}: {error}", operation)

    # -- topics ---------------------------------------------------------------------------

    def _subscribe(self, operation: dict[str, Any]) -> Iterator[Effect]:
        topic = self._name(operation, "topic", self._settings.topics)
        kind = _type(operation) if operation.get("type") is not None else None
        request = DeliveryOptions(
            WireEncoding.of(operation.get("compression")),
            max(_number(operation, "throttle_rate", least=-math.inf), 0) / 1000,
            int(_number(operation, "queue_length")),
            int(_number(operation, "fragment_size")),
        )
        check_codec(request.encoding)
        key = _key(operation)
        known = self._topics.get(topic)
        if known is None:
            self._check_limit(self._topics, "subscriptions")
            known = _TopicState(kind)
        elif kind is not None and known.kind is not None and kind != known.kind:
            raise BadOperation(f"this client subscribes to {topic} with the type {known.kind}, not {kind}")
        elif known.requests.get(key) == request and kind in (None, known.kind):
            return
        if key not in known.requests:
            self._check_limit(known.requests, f"subscriptions to {topic}")
            self._shares.keep(_cost(key) + (0 if topic in self._topics else _cost_of_name(topic)))
        known.kind = known.kind or kind
        known.requests[key] = request
        self._topics[topic] = known
        yield TakeTopic(topic, known.kind, known.delivery(), operation)

    def _unsubscribe(self, operation: dict[str, Any]) -> Iterator[Effect]:
        topic = self._name(operation, "topic")
        known = self._topics.get(topic)
        if known is None:
            return
        key = _key(operation)
        gone = list(known.requests) if operation.get("id") is None else [key] if key in known.requests else []
        for each in gone:
            del known.requests[each]
            self._shares.release(_cost(each))
        if not known.requests:
            del self._topics[topic]
            self._shares.release(_cost_of_name(topic))
            yield LeaveTopic(topic)
        elif gone:
            yield TakeTopic(topic, known.kind, known.delivery(), operation)

    def _advertise(self, operation: dict[str, Any]) -> Iterator[Effect]:
        topic = self._name(operation, "topic", self._settings.topics)
        kind = _type(operation)
        latch = _flag(operation, "latch") or False
        queue_size = int(_number(operation, "queue_size", QUEUE_SIZE))
        key = _key(operation)
        self._check_advertised(topic)
        ids = self._advertised.get(topic, set())
        if key not in ids:
            self._check_limit(ids, f"advertisements of {topic}")
            self._shares.keep(_cost(key) + (0 if ids else _cost_of_name(topic)))
            self._advertised.setdefault(topic, set()).add(key)
        yield Advertise(topic, kind, latch, queue_size, operation)

    def _unadvertise(self, operation: dict[str, Any]) -> Iterator[Effect]:
        topic = self._name(operation, "topic")
        key = _key(operation)
        ids = self._advertised.get(topic, set())
        for each in list(ids) if operation.get("id") is None else [key] if key in ids else []:
            ids.remove(each)
            self._shares.release(_cost(each))
        if topic in self._advertised and not ids:
            del self._advertised[topic]
            self._shares.release(_cost_of_name(topic))
            yield Unadvertise(topic)

    def _publish(self, operation: dict[str, Any]) -> Iterator[Effect]:
        topic = self._name(operation, "topic", self._settings.topics)
        values = operation.get("msg", {})
        if not isinstance(values, (dict, list)):
            # For many topics an empty message is a command, such as a velocity of zero.
            raise BadOperation(f"msg must be an object, got {_quoted(values)}")
        latch, queue_size = _flag(operation, "latch"), int(_number(operation, "queue_size", QUEUE_SIZE))
        if topic not in self._advertised:
            self._check_advertised(topic)
            self._shares.keep(_cost_of_name(topic) + _cost("null"))
            self._advertised[topic] = {"null"}
        yield Publish(topic, values, latch, queue_size, operation)

    # -- services -------------------------------------------------------------------------

    def _call_service(self, operation: dict[str, Any]) -> Iterator[Effect]:
        # As in rosbridge, a number after `#` only distinguishes calls.
        service = self._name(operation, "service", self._settings.services, end="#")
        fragment_size = int(_number(operation, "fragment_size"))
        yield CallService(service, operation.get("args"), fragment_size, operation)

    def _advertise_service(self, operation: dict[str, Any]) -> Iterator[Effect]:
        service, kind = self._name(operation, "service", self._settings.services), _type(operation)
        if service not in self._offered:
            self._check_limit(self._offered, "offered services")
            self._shares.keep(_cost_of_name(service))
        self._offered.add(service)
        yield OfferService(service, kind, operation)

    def _unadvertise_service(self, operation: dict[str, Any]) -> Iterator[Effect]:
        service = self._name(operation, "service")
        if service not in self._offered:
            raise BadOperation(f"this client does not offer {service}")
        self._offered.discard(service)
        self._shares.release(_cost_of_name(service))
        yield WithdrawService(service)

    def _service_response(self, operation: dict[str, Any]) -> Iterator[Effect]:
        service = self._name(operation, "service")
        if service not in self._offered:
            raise BadOperation(f"this client does not offer {service}")
        is_success = _flag(operation, "result")
        yield AnswerCall(
            service, operation.get("id"), operation.get("values"), is_success is not False, operation
        )

    # -- the connection ---------------------------------------------------------------------

    def _set_level(self, operation: dict[str, Any]) -> Iterator[Effect]:
        known = [level.name.lower() for level in Level]
        if operation.get("level") not in known:
            raise BadOperation(
                f"level must be one of {', '.join(known)}; got {_quoted(operation.get('level'))}"
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
            raise BadOperation(f"{key} must be a name, got {_quoted(name)}")
        try:
            resolved = self._resolve(name)
        except InvalidName as error:
            raise BadOperation(str(error)) from None
        if globs is not None and not globs.allow(resolved):
            raise BadOperation(f"clients may not use {resolved}; they may use {', '.join(globs.patterns)}")
        return name

    def _check_advertised(self, topic: str) -> None:
        if topic not in self._advertised:
            self._check_limit(self._advertised, "advertised topics")

    def _check_limit(self, known: Any, what: str) -> None:
        if len(known) >= self._max_names:
            limit = f"the limit is {self._max_names}"
            raise BadOperation(f"too many {what}; {limit}")


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


def _key(operation: Mapping[str, Any]) -> str:
    """Convert an operation's id, which can be of any type, to a dictionary key."""
    identity = operation.get("id")
    key = "null" if identity is None else json.dumps(identity, default=str, sort_keys=True)
    if len(key) > ID_CHARACTERS:
        raise BadOperation(f"id must have at most {ID_CHARACTERS} characters, got {len(key)}")
    return key


def _cost(key: str) -> int:
    """Return the approximate memory for an id."""
    return len(key) + _ID_BYTES


def _cost_of_name(name: str) -> int:
    """Return the approximate memory for a topic or a service."""
    return 4 * len(name) + _NAME_BYTES


def _type(operation: Mapping[str, Any]) -> str:
    kind = operation.get("type")
    text = kind if isinstance(kind, str) and len(kind) <= ID_CHARACTERS else ""
    parts = [part for part in text.split("/") if part]
    if len(parts) < 2:
        raise BadOperation(f"type must be package/Name, got {_quoted(kind)}")
    package, *_, name = parts
    return f"{package}/{name}"  # accept ROS 2 names, such as `std_msgs/msg/String`


def _number(operation: Mapping[str, Any], key: str, default: int = 0, *, least: float = 0) -> float:
    """Return a field that must be a finite number >= `least`, or the default if the field is missing or null.

    Numbers beyond ±2**31 are replaced by this limit.
    """
    value = operation.get(key)
    if value is None:
        return default
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value < math.inf:
        rule = "a finite number >= 0" if least == 0 else "a finite number"
        raise BadOperation(f"{key} must be {rule}, got {_quoted(value)}")
    return max(min(value, 2**31), -(2**31))


def _flag(operation: Mapping[str, Any], key: str) -> bool | None:
    value = operation.get(key)
    if value is not None and not isinstance(value, bool):
        raise BadOperation(f"{key} must be true or false, got {_quoted(value)}")
    return value


def _quoted(value: object) -> str:
    return printable(repr(value), 100) if value is not None else "null"
