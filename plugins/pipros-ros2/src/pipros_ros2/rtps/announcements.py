"""Announcements of participants (SPDP) and of their endpoints (SEDP)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from struct import Struct
from typing import Final, TypeVar

from pipros_ros2.rtps.identity import GUID_BYTES, OWN_VENDOR, PARTICIPANT_ENTITY, PROTOCOL_VERSION, is_writer
from pipros_ros2.rtps.parameters import (
    PARAMETER_LIST,
    SENTINEL,
    Address,
    Parameter,
    Parameters,
    duration,
    integer,
    locator,
    octets,
    parameter,
    read_duration,
    read_integer,
    read_locator,
    read_octets,
    read_parameter_list,
    read_text,
    text,
)
from pipros_ros2.rtps.qos import DurabilityKind, Liveliness, Qos, ReliabilityKind

_BUILTIN_ENDPOINTS: Final = 0x3F
"""Bits for the built-in writers and readers of participants, publications and subscriptions."""
_MAX_LOCATORS: Final = 16
_MAX_PARTITIONS: Final = 64
_MAX_REPRESENTATIONS: Final = 16
_MAX_BLOCKING_S: Final = 0.1
_REPRESENTATIONS = Struct(">h"), Struct("<h")
_Enum = TypeVar("_Enum", bound=IntEnum)


@dataclass(frozen=True, slots=True)
class ParticipantData:
    """A participant's announcement.

    Attributes:
        lease_s: time without a datagram after which the participant is considered gone.
        discovery: addresses for endpoint announcements.
        data: addresses for samples, unless an endpoint has its own.
        user_data: entries such as `enclave=/;`.
    """

    prefix: bytes
    vendor: bytes = OWN_VENDOR
    lease_s: float = 10.0
    discovery: tuple[Address, ...] = ()
    data: tuple[Address, ...] = ()
    user_data: bytes = b""


@dataclass(frozen=True, slots=True)
class EndpointData:
    """An endpoint's announcement. Names are DDS names: `rt/chatter`, `std_msgs::msg::dds_::String_`."""

    guid: bytes
    topic: str
    type_name: str
    qos: Qos
    user_data: bytes = b""
    addresses: tuple[Address, ...] = ()

    @property
    def is_writer(self) -> bool:
        return is_writer(self.guid)


def write_participant(participant: ParticipantData) -> bytes:
    """Return the payload of a participant's announcement."""
    return b"".join(
        (
            PARAMETER_LIST,
            parameter(Parameter.PROTOCOL_VERSION, PROTOCOL_VERSION),
            parameter(Parameter.VENDOR_ID, participant.vendor),
            parameter(Parameter.PARTICIPANT_GUID, participant.prefix + PARTICIPANT_ENTITY),
            parameter(Parameter.BUILTIN_ENDPOINTS, integer(_BUILTIN_ENDPOINTS)),
            *(parameter(Parameter.META_UNICAST_LOCATOR, locator(each)) for each in participant.discovery),
            *(parameter(Parameter.DEFAULT_UNICAST_LOCATOR, locator(each)) for each in participant.data),
            parameter(Parameter.LEASE_DURATION, duration(participant.lease_s)),
            parameter(Parameter.USER_DATA, octets(participant.user_data)),
            SENTINEL,
        )
    )


def write_endpoint(endpoint: EndpointData) -> bytes:
    """Return the payload of an endpoint's announcement, without policies that ROS 2 never changes."""
    qos = endpoint.qos
    return b"".join(
        (
            PARAMETER_LIST,
            parameter(Parameter.ENDPOINT_GUID, endpoint.guid),
            parameter(Parameter.PARTICIPANT_GUID, endpoint.guid[:12] + PARTICIPANT_ENTITY),
            parameter(Parameter.TOPIC_NAME, text(endpoint.topic)),
            parameter(Parameter.TYPE_NAME, text(endpoint.type_name)),
            parameter(Parameter.RELIABILITY, integer(qos.reliability) + duration(_MAX_BLOCKING_S)),
            parameter(Parameter.DURABILITY, integer(qos.durability)),
            parameter(Parameter.DEADLINE, duration(qos.deadline_s)),
            parameter(Parameter.LIVELINESS, integer(qos.liveliness) + duration(qos.lease_s)),
            parameter(
                Parameter.DATA_REPRESENTATION,
                integer(len(qos.representations))
                + b"".join(_REPRESENTATIONS[1].pack(each) for each in qos.representations),
            ),
            *(parameter(Parameter.UNICAST_LOCATOR, locator(each)) for each in endpoint.addresses),
            *([parameter(Parameter.USER_DATA, octets(endpoint.user_data))] if endpoint.user_data else ()),
            parameter(Parameter.KEY_HASH, endpoint.guid),
            SENTINEL,
        )
    )


def write_key(name: Parameter, guid: bytes) -> bytes:
    """Return the payload that announces the end of a participant or endpoint. It contains only the key."""
    return PARAMETER_LIST + parameter(name, guid) + SENTINEL


class _ParameterValues:
    """Decodes parameter values. Missing and malformed values yield None or a default.

    Only the first value of a repeated parameter is used, except for addresses.
    """

    def __init__(self, parameters: Parameters, is_little: bool) -> None:
        self._parameters = parameters
        self.is_little = is_little

    def raw(self, name: Parameter) -> bytes | None:
        values = self._parameters.get(name)
        return values[0] if values else None

    def guid(self, name: Parameter) -> bytes | None:
        value = self.raw(name)
        return value[:GUID_BYTES] if value is not None and len(value) >= GUID_BYTES else None

    def text(self, name: Parameter) -> str | None:
        value = self.raw(name)
        return None if value is None else read_text(value, self.is_little)

    def duration(self, name: Parameter, offset: int = 0, default: float = math.inf) -> float:
        value = self.raw(name)
        found = None if value is None else read_duration(value[offset:], self.is_little)
        return default if found is None else found

    def enum(self, name: Parameter, kind: type[_Enum], default: _Enum) -> _Enum:
        value = self.raw(name)
        number = None if value is None else read_integer(value, self.is_little)
        return default if number is None or number not in set(kind) else kind(number)

    def octets(self, name: Parameter) -> bytes:
        value = self.raw(name)
        return b"" if value is None else read_octets(value, self.is_little)

    def addresses(self, name: Parameter) -> tuple[Address, ...]:
        values = self._parameters.get(name, [])[:_MAX_LOCATORS]
        return tuple(found for value in values if (found := read_locator(value, self.is_little)))

    def representations(self) -> tuple[int, ...]:
        value = self.raw(Parameter.DATA_REPRESENTATION) or b""
        available = min((len(value) - 4) // 2, _MAX_REPRESENTATIONS)
        count = min(read_integer(value, self.is_little) or 0, available)
        layout = _REPRESENTATIONS[self.is_little]
        return tuple(layout.unpack_from(value, 4 + 2 * index)[0] for index in range(count))

    def partitions(self) -> tuple[str, ...]:
        value = self.raw(Parameter.PARTITION)
        if value is None:
            return ()
        names: list[str] = []
        position = 4
        for _ in range(min(read_integer(value, self.is_little) or 0, _MAX_PARTITIONS)):
            name = read_text(value[position:], self.is_little)
            if name is None:
                break
            names.append(name)
            position += 4 + (read_integer(value[position:], self.is_little) or 0)
            position += -position % 4
        return tuple(names)


def _values(payload: bytes | memoryview) -> _ParameterValues | None:
    found = read_parameter_list(payload)
    return None if found is None else _ParameterValues(*found)


def read_participant(payload: bytes | memoryview) -> ParticipantData | None:
    """Decode a participant's announcement; return None if it lacks a GUID or a usable address."""
    values = _values(payload)
    if values is None:
        return None
    guid = values.guid(Parameter.PARTICIPANT_GUID)
    discovery = values.addresses(Parameter.META_UNICAST_LOCATOR)
    if guid is None or not discovery:
        return None
    return ParticipantData(
        guid[:12],
        (values.raw(Parameter.VENDOR_ID) or OWN_VENDOR)[:2],
        values.duration(Parameter.LEASE_DURATION, default=100.0),
        discovery,
        values.addresses(Parameter.DEFAULT_UNICAST_LOCATOR) or discovery,
        values.octets(Parameter.USER_DATA),
    )


def read_endpoint(payload: bytes | memoryview) -> EndpointData | None:
    """Decode an endpoint's announcement; return None if it lacks a GUID, topic or type."""
    values = _values(payload)
    if values is None:
        return None
    guid = values.guid(Parameter.ENDPOINT_GUID)
    topic, type_name = values.text(Parameter.TOPIC_NAME), values.text(Parameter.TYPE_NAME)
    if guid is None or topic is None or type_name is None:
        return None
    default = ReliabilityKind.RELIABLE if is_writer(guid) else ReliabilityKind.BEST_EFFORT
    ownership = read_integer(values.raw(Parameter.OWNERSHIP) or bytes(4), values.is_little) or 0
    qos = Qos(
        reliability=values.enum(Parameter.RELIABILITY, ReliabilityKind, default),
        durability=values.enum(Parameter.DURABILITY, DurabilityKind, DurabilityKind.VOLATILE),
        deadline_s=values.duration(Parameter.DEADLINE),
        liveliness=values.enum(Parameter.LIVELINESS, Liveliness, Liveliness.AUTOMATIC),
        lease_s=values.duration(Parameter.LIVELINESS, offset=4),
        ownership=ownership,
        partitions=values.partitions(),
        representations=values.representations(),
    )
    user_data = values.octets(Parameter.USER_DATA)
    return EndpointData(guid, topic, type_name, qos, user_data, values.addresses(Parameter.UNICAST_LOCATOR))


def read_key(payload: bytes | memoryview, name: Parameter) -> bytes | None:
    """Return the GUID of the removed participant or endpoint, or None if the payload contains no GUID."""
    values = _values(payload)
    return None if values is None else values.guid(name)


def entries(user_data: bytes) -> dict[str, str]:
    """Parse the entries of USER_DATA.

    >>> entries(b"enclave=/;typehash=RIHS01_00;")
    {'enclave': '/', 'typehash': 'RIHS01_00'}
    """
    words = user_data.rstrip(b"\0").decode("utf-8", "replace").split(";")
    pairs = (word.partition("=") for word in words if "=" in word)
    return {name: value for name, _, value in pairs}
