"""Parse messages from Foxglove clients: JSON objects with an `op`, and binary data with an opcode.

Performs no I/O. Source: https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md. Binary integers are
little-endian.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from pipros.basics.errors import ProtocolError
from pipros.basics.printable import printable

T = TypeVar("T")

REQUEST_CHARACTERS: Final = 1_000_000
"""Maximum length of a JSON object from a client."""
NAMES: Final = 2_000
"""Maximum number of parameter names in one request."""

_PUBLISH, _CALL = 1, 2
_ID = struct.Struct("<I")
_CALL_HEAD = struct.Struct("<III")
_LIMIT_OF_IDS = 1 << 32


class MalformedRequest(ProtocolError):
    """A client's message violates the protocol. The connection stays open."""


@dataclass(frozen=True, slots=True)
class Subscribe:
    """New subscriptions: pairs of a subscription id, chosen by the client, and a channel id."""

    pairs: Sequence[tuple[int, int]]


@dataclass(frozen=True, slots=True)
class Unsubscribe:
    ids: Sequence[int]


@dataclass(frozen=True, slots=True)
class ClientChannel:
    """A topic that a client is about to publish. `schema` is empty if the client sent none."""

    id: int
    topic: str
    encoding: str
    type: str
    schema: str


@dataclass(frozen=True, slots=True)
class AdvertiseRequest:
    channels: Sequence[ClientChannel]


@dataclass(frozen=True, slots=True)
class UnadvertiseRequest:
    ids: Sequence[int]


@dataclass(frozen=True, slots=True)
class PublishRequest:
    channel: int
    body: bytes


@dataclass(frozen=True, slots=True)
class CallRequest:
    service: int
    call: int
    encoding: str
    body: bytes


@dataclass(frozen=True, slots=True)
class GetParameters:
    """A request for the parameters in `names`, or for all parameters if `names` is empty.

    The response includes `id`, if given.
    """

    names: Sequence[str]
    id: str | None


@dataclass(frozen=True, slots=True)
class SetParameters:
    """New parameter values: objects with `name`, `value` and optionally `type`.

    A parameter without `value` is deleted.
    """

    parameters: Sequence[Mapping[str, Any]]
    id: str | None


@dataclass(frozen=True, slots=True)
class SubscribeParameters:
    """A subscription to the parameters in `names`, or to all parameters if `names` is empty."""

    names: Sequence[str]


@dataclass(frozen=True, slots=True)
class UnsubscribeParameters:
    names: Sequence[str]


@dataclass(frozen=True, slots=True)
class SubscribeGraph:
    is_wanted: bool


@dataclass(frozen=True, slots=True)
class FetchAsset:
    uri: str
    request: int


ClientRequest = (
    Subscribe
    | Unsubscribe
    | AdvertiseRequest
    | UnadvertiseRequest
    | PublishRequest
    | CallRequest
    | GetParameters
    | SetParameters
    | SubscribeParameters
    | UnsubscribeParameters
    | SubscribeGraph
    | FetchAsset
)


Report = Callable[[MalformedRequest], object]


def _refuse(error: MalformedRequest) -> None:
    raise error


CAPABILITY_OF: Final[Mapping[type, str | None]] = {
    Subscribe: None,
    Unsubscribe: None,
    AdvertiseRequest: "clientPublish",
    PublishRequest: "clientPublish",
    UnadvertiseRequest: "clientPublish",
    CallRequest: "services",
    GetParameters: "parameters",
    SetParameters: "parameters",
    SubscribeParameters: "parametersSubscribe",
    UnsubscribeParameters: "parametersSubscribe",
    SubscribeGraph: "connectionGraph",
    FetchAsset: "assets",
}
"""The capability that each request requires. Topic subscriptions require none; a request must be listed."""


def read_request(data: str | bytes, report: Report = _refuse) -> ClientRequest:
    """Return the request in a message from a client.

    Wrong entries of a list are left out, and `report` is called once for them, if others are valid.

    Raises:
        MalformedRequest: the message is not a valid request.
    """
    if isinstance(data, bytes):
        return _read_binary(data)
    if len(data) > REQUEST_CHARACTERS:
        raise MalformedRequest(
            f"a JSON message must have at most {REQUEST_CHARACTERS} characters, got {len(data)}"
        )
    try:
        values = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise MalformedRequest(f"the message is not JSON: {error}") from None
    if not isinstance(values, dict):
        raise MalformedRequest(f"a message must be a JSON object, got {type(values).__name__}")
    op = values.get("op")
    read = READERS.get(op) if isinstance(op, str) else None
    if read is None:
        raise MalformedRequest(f"unknown operation {printable(repr(op), 100)}")
    return read(_RequestFields(values, report=report))


def _read_binary(data: bytes) -> ClientRequest:
    opcode = data[0] if data else None
    try:
        if opcode == _PUBLISH:
            return PublishRequest(_ID.unpack_from(data, 1)[0], data[1 + _ID.size :])
        if opcode == _CALL:
            service, call, length = _CALL_HEAD.unpack_from(data, 1)
            begin = 1 + _CALL_HEAD.size
            if length > len(data) - begin:
                raise MalformedRequest(f"an encoding of {length} bytes exceeds the message")
            encoding = data[begin : begin + length].decode("utf-8", "replace")
            return CallRequest(service, call, encoding, data[begin + length :])
    except struct.error:
        raise MalformedRequest(f"a binary message with opcode {opcode} is too short") from None
    raise MalformedRequest(f"unknown binary opcode {opcode}")


class _RequestFields:
    """Type-checked access to the fields of a JSON object."""

    def __init__(self, values: object, where: str = "", report: Report = _refuse) -> None:
        if not isinstance(values, dict):
            raise MalformedRequest(f"{where} must contain objects, got {type(values).__name__}")
        self.values = values
        self._report = report

    def text(self, name: str) -> str:
        value = self.values.get(name)
        if not isinstance(value, str):
            raise MalformedRequest(f"{name} must be a string, got {type(value).__name__}")
        return value

    def optional_text(self, name: str) -> str | None:
        return self.text(name) if self.values.get(name) is not None else None

    def number(self, name: str) -> int:
        return _number(self.values.get(name), name)

    def numbers(self, name: str) -> list[int]:
        return self._valid(name, lambda value: _number(value, name))

    def texts(self, name: str) -> list[str]:
        if self.values.get(name) is None:
            return []
        values = self._valid(name, lambda value: _text(value, name))
        if len(values) > NAMES:
            raise MalformedRequest(f"{name} must contain at most {NAMES} names, got {len(values)}")
        return values

    def objects(self, name: str, read: Callable[[_RequestFields], T]) -> list[T]:
        return self._valid(name, lambda value: read(_RequestFields(value, name)))

    def _valid(self, name: str, read: Callable[[Any], T]) -> list[T]:
        """Return the valid entries of a list. Without any, an empty list would be another request."""
        found, wrong = [], []
        for index, value in enumerate(self._list(name)):
            try:
                found.append(read(value))
            except MalformedRequest as error:
                wrong.append(f"{name}[{index}]: {error}")
        if wrong:
            more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
            (self._report if found else _refuse)(MalformedRequest(wrong[0] + more))
        return found

    def _list(self, name: str) -> list[Any]:
        value = self.values.get(name)
        if not isinstance(value, list):
            raise MalformedRequest(f"{name} must be a list, got {type(value).__name__}")
        return value


def _number(value: object, name: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < _LIMIT_OF_IDS:
        raise MalformedRequest(f"{name} must be a 32-bit unsigned integer, got {printable(repr(value), 100)}")
    return value


def _text(value: object, name: str) -> str:
    if not isinstance(value, str):
        raise MalformedRequest(f"{name} must contain strings, got {type(value).__name__}")
    return value


def _channel(fields: _RequestFields) -> ClientChannel:
    return ClientChannel(
        fields.number("id"),
        fields.text("topic"),
        fields.text("encoding"),
        fields.text("schemaName"),
        fields.optional_text("schema") or "",
    )


def _parameter(fields: _RequestFields) -> Mapping[str, Any]:
    fields.text("name")
    return fields.values


READERS: Final[Mapping[str, Callable[[_RequestFields], ClientRequest]]] = {
    "subscribe": lambda of: Subscribe(
        of.objects("subscriptions", lambda each: (each.number("id"), each.number("channelId")))
    ),
    "unsubscribe": lambda of: Unsubscribe(of.numbers("subscriptionIds")),
    "advertise": lambda of: AdvertiseRequest(of.objects("channels", _channel)),
    "unadvertise": lambda of: UnadvertiseRequest(of.numbers("channelIds")),
    "getParameters": lambda of: GetParameters(of.texts("parameterNames"), of.optional_text("id")),
    "setParameters": lambda of: SetParameters(of.objects("parameters", _parameter), of.optional_text("id")),
    "subscribeParameterUpdates": lambda of: SubscribeParameters(of.texts("parameterNames")),
    "unsubscribeParameterUpdates": lambda of: UnsubscribeParameters(of.texts("parameterNames")),
    "subscribeConnectionGraph": lambda _: SubscribeGraph(is_wanted=True),
    "unsubscribeConnectionGraph": lambda _: SubscribeGraph(is_wanted=False),
    "fetchAsset": lambda of: FetchAsset(of.text("uri"), of.number("requestId")),
}
