"""Publications and service calls of one Foxglove client. All functions may block."""

from __future__ import annotations

import json
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.msg import load_service_class
from pipros.msg.base import Message
from pipros.msg.class_finder import installed_class
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.from_yaml import fill_message_args
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.codec import encoder
from pipros.node.open_calls import OpenCalls
from pipros.node.service_client import ServiceClient
from pipros_bridges.foxglove.catalog import Service
from pipros_bridges.foxglove.requests import ClientChannel
from pipros_bridges.shared_topics import check_published_type
from pipros_libraries.nodes.velocities import RelayedVelocity
from pipros_libraries.topic_tools.raw import class_like
from pipros_server.act_gate import ActGate
from pipros_server.json_text import encoded

ROS1, JSON = "ros1", "json"
ENCODINGS: Final = (ROS1, JSON)
"""Encodings of clients' messages and service requests."""
QUEUE_SIZE: Final = 10
"""Queue size of a publication, in messages."""


class UnsupportedMessage(PiprosError):
    """The encoding or type of a client's channel or service call is not supported."""


class ClientPublication:
    """A topic that a client publishes."""

    def __init__(self, node: Node, gate: ActGate, channel: ClientChannel) -> None:
        """Advertise the topic.

        Raises:
            UnsupportedMessage: the encoding or the type cannot be used.
            ActRefused: the policy does not allow the topic.
            PiprosError: the topic is published with another type, or its name is invalid.
        """
        _check_encoding(channel.encoding)
        self.channel = channel
        found = _class_of(channel)
        gate.check_topic(channel.topic, found._type, found._md5sum)
        check_published_type(node, channel.topic, found._type)
        self._gate = gate
        header = {"type": found._type, "md5sum": found._md5sum, "message_definition": found._full_text}
        self._class = found
        self._raw = class_like(header)
        self._publisher = node.advertise(channel.topic, self._raw, queue_size=QUEUE_SIZE)
        self._velocity = RelayedVelocity(node, self._publisher)

    def publish(self, body: bytes) -> None:
        """Publish a message.

        Raises:
            ActRefused: the policy does not allow the message.
            PiprosError, ValueError: the message is not JSON, or does not fit the type.
        """
        if self.channel.encoding == JSON:
            body = _from_json(self._class, body)
        self._gate.check_message(self.channel.topic, body, self._class._type, self._class._md5sum, self)
        message = self._raw(body)
        self._velocity.note(message)
        self._publisher.publish(message)
        self._gate.renew_after_publishing(self.channel.topic, body)

    def close(self) -> None:
        """Unadvertise the topic. First stop what the client started; a velocity also without a policy."""
        if self._gate.left(self.channel.topic, self):
            self._velocity.forget()
        else:
            self._velocity.end()
        self._publisher.unregister()


def call_service(
    node: Node,
    gate: ActGate,
    service: Service,
    encoding: str,
    body: bytes,
    calls: OpenCalls,
    timeout_s: float,
) -> bytes:
    """Call a service and return its response, in the encoding of the request.

    Raises:
        PiprosError, ValueError: the policy refuses the call, the request is malformed, or the call failed.
    """
    _check_encoding(encoding)
    definition = service.definition
    found: Any = load_service_class(definition.type) if encoding == JSON else None
    if found is not None:
        body = _from_json(found._request_class, body)
    request_class = class_like({"type": f"{definition.type}Request", "md5sum": definition.md5sum})
    fields = {
        "_type": definition.type,
        "_md5sum": definition.md5sum,
        "_request_class": request_class,
        "_response_class": AnyMsg,
    }
    raw: Any = type("RawService", (), fields)
    client = ServiceClient(service.name, raw, master=lambda: node.master, calls=calls, limits=node.limits)
    with gate.calling(service.name, body, definition.type, definition.md5sum):
        answer: bytes = client.call(request_class(body), timeout_s).body
    return answer if found is None else _to_json(found._response_class._from_bytes(answer))


def _check_encoding(encoding: str) -> None:
    if encoding not in ENCODINGS:
        raise UnsupportedMessage(
            f"encoding {printable(repr(encoding), 100)} is not one of {', '.join(ENCODINGS)}"
        )


def _class_of(channel: ClientChannel) -> type[Message]:
    """Return the message class for a client's channel: installed, or created from its schema."""
    installed = installed_class(channel.type)
    if not channel.schema.strip():
        if installed is None:
            raise UnsupportedMessage(
                f"type [{printable(channel.type)}] is not installed, and its schema is missing"
            )
        return installed
    found = message_classes_from_text(channel.type, channel.schema)[channel.type]
    if installed is not None and installed._md5sum != found._md5sum:
        raise UnsupportedMessage(
            f"the schema of [{printable(channel.type)}] differs from the installed definition"
        )
    return installed or found


def _from_json(message_class: type[Message], body: bytes) -> bytes:
    try:
        values = json.loads(body) if body.strip() else {}
    except (ValueError, RecursionError) as error:
        raise ValueError(f"the message is not JSON: {error}") from None
    if not isinstance(values, dict):
        raise ValueError(f"the message must be a JSON object, got {type(values).__name__}")
    message = message_class()
    fill_message_args(message, [values])
    return b"".join(encoder(message_class)(message))


def _to_json(message: Message) -> bytes:
    return encoded(_plain(message)).encode()


def _plain(value: Any) -> Any:
    if isinstance(value, Message):
        return {name: _plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    if isinstance(value, bytes):
        return list(value)
    if hasattr(value, "nsecs"):
        return {"secs": value.secs, "nsecs": value.nsecs}
    return value
