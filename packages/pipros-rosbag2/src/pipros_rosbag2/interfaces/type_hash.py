"""ROS 2 type hashes (RIHS01, REP 2016): the SHA-256 of a JSON description of the type.

Since Iron, endpoints announce the hash of their type, and rmw_zenoh includes it in keys.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pipros_rosbag2.interfaces.action_types import STATUS_ARRAY, Ros2Action
from pipros_rosbag2.interfaces.catalog import embedded_messages
from pipros_rosbag2.interfaces.spec import Form, Ros2Field, Ros2Message, Ros2Service, Ros2Type

Lookup = Callable[[str], Ros2Message]

_IDS = {
    "int8": 2,
    "uint8": 3,
    "char": 3,  # in definitions, char is an unsigned byte
    "int16": 4,
    "uint16": 5,
    "int32": 6,
    "uint32": 7,
    "int64": 8,
    "uint64": 9,
    "float32": 10,
    "float64": 11,
    "bool": 15,
    "byte": 16,
    "string": 17,
    "wstring": 18,
}
_NESTED = 1
_BOUNDED_STRINGS = 4
"""Added to the ID of a string type with a maximum length."""
_FORMS = {Form.SINGLE: 0, Form.ARRAY: 48, Form.BOUNDED: 96, Form.SEQUENCE: 144}

_EVENT_INFO = "service_msgs/msg/ServiceEventInfo"


def message_hash(message: Ros2Message, lookup: Lookup) -> str:
    """Return the hash of a message type: `RIHS01_` and 64 hexadecimal digits.

    Raises:
        NotFound: an embedded type is unknown.
        DefinitionError: a type contains itself, or messages are nested too deeply.
    """
    embedded = embedded_messages(message, lookup)
    description = {
        "type_description": _described(message),
        "referenced_type_descriptions": [_described(embedded[name]) for name in sorted(embedded)],
    }
    return f"RIHS01_{hashlib.sha256(json.dumps(description).encode()).hexdigest()}"


def service_hash(service: Ros2Service, lookup: Lookup) -> str:
    """Return the hash of a service type.

    The description has three members: request, response, and the event that introspection publishes.
    Raises the same errors as `message_hash`.
    """
    event = Ros2Message(
        f"{service.type}_Event",
        (
            Ros2Field(Ros2Type(_EVENT_INFO), "info"),
            Ros2Field(Ros2Type(service.request.type, Form.BOUNDED, 1), "request"),
            Ros2Field(Ros2Type(service.response.type, Form.BOUNDED, 1), "response"),
        ),
    )
    halves = {each.type: each for each in (service.request, service.response, event)}
    whole = Ros2Message(
        service.type,
        (
            Ros2Field(Ros2Type(service.request.type), "request_message"),
            Ros2Field(Ros2Type(service.response.type), "response_message"),
            Ros2Field(Ros2Type(event.type), "event_message"),
        ),
    )
    return message_hash(whole, lambda name: halves.get(name) or lookup(name))


@dataclass(frozen=True, slots=True)
class ActionHashes:
    """The type hashes of an action's services and topics; all empty in Humble.

    Attributes:
        send_goal_parts, get_result_parts, cancel_goal_parts: hashes of the request and the response.
    """

    send_goal: str = ""
    get_result: str = ""
    cancel_goal: str = ""
    feedback: str = ""
    status: str = ""
    send_goal_parts: tuple[str, str] = ("", "")
    get_result_parts: tuple[str, str] = ("", "")
    cancel_goal_parts: tuple[str, str] = ("", "")


def action_hashes(action: Ros2Action, cancel_goal: Ros2Service, lookup: Lookup) -> ActionHashes:
    """Return the type hashes of an action. Raises the same errors as `message_hash`."""
    parts = {each.type: each for each in (action.goal, action.result, action.feedback)}

    def of_action(name: str) -> Ros2Message:
        return parts.get(name) or lookup(name)

    return ActionHashes(
        service_hash(action.send_goal, of_action),
        service_hash(action.get_result, of_action),
        service_hash(cancel_goal, lookup),
        message_hash(action.feedback_message, of_action),
        message_hash(lookup(STATUS_ARRAY), lookup),
        *(
            (message_hash(each.request, of_action), message_hash(each.response, of_action))
            for each in (action.send_goal, action.get_result, cancel_goal)
        ),
    )


def _described(message: Ros2Message) -> dict[str, Any]:
    return {
        "type_name": message.type,
        "fields": [{"name": field.name, "type": _described_type(field.type)} for field in message.fields],
    }


def _described_type(kind: Ros2Type) -> dict[str, Any]:
    number = _IDS[kind.base] if kind.is_primitive else _NESTED
    number += _BOUNDED_STRINGS if kind.string_bound else 0
    return {
        "type_id": number + _FORMS[kind.form],
        "capacity": kind.length,
        "string_capacity": kind.string_bound,
        "nested_type_name": "" if kind.is_primitive else kind.base,
    }
