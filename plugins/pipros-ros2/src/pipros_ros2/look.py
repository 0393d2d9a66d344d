"""A view of a ROS 2 domain for commands: its nodes, topics, services and actions, and single messages."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from pipros.basics.errors import InvalidName, NotFound, PiprosError
from pipros.basics.printable import listed
from pipros_ros2.interface import Endpoint, EndpointKind, PartHashes, Reliability, Ros2Engine, TopicQos
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.engine import RtpsEngine
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog
from pipros_rosbag2.interfaces.cdr import decode, encode
from pipros_rosbag2.interfaces.installed import installed_definitions
from pipros_rosbag2.interfaces.spec import Form, Ros2Message, Ros2Service
from pipros_rosbag2.interfaces.type_hash import message_hash

_POLL_S: Final = 0.05
_QUIET_S: Final = 0.5
"""Discovery is complete if nothing new was found for this time."""
_LONGEST_S: Final = 5.0
_SEND_GOAL: Final = "/_action/send_goal"
_PUBLISHERS, _SUBSCRIBERS = EndpointKind.PUBLISHER, EndpointKind.SUBSCRIBER
_SERVERS, _CLIENTS = EndpointKind.SERVER, EndpointKind.CLIENT
TRUNCATED: Final = 128
"""Number of characters or elements after which texts and arrays are shortened, as in ROS 2."""


class DomainView:
    """A connection to a ROS 2 domain.

    Args:
        folders: see `Catalog`.

    Raises:
        Unreachable: this machine has no free port in the domain.
    """

    def __init__(
        self, discovery: Discovery, distribution: Distribution, folders: Sequence[str | os.PathLike[str]] = ()
    ) -> None:
        self.engine: Ros2Engine = RtpsEngine(discovery, f"/_pipros_{os.getpid()}")
        self._catalog = Catalog(
            distribution, installed_definitions(), [Path(each) for each in folders], derive=True
        )
        self._has_hashes = distribution.has_type_hashes

    def close(self) -> None:
        self.engine.close()

    def endpoints(self, least_s: float = 1.0) -> Sequence[Endpoint]:
        """Return all endpoints, after no further ones were found for half a second.

        Waits from `least_s` up to 5 s.
        """
        begin_s = changed_s = time.monotonic()
        found = self.engine.endpoints()
        while (now_s := time.monotonic()) < begin_s + _LONGEST_S:
            if now_s > begin_s + least_s and now_s > changed_s + _QUIET_S:
                break
            time.sleep(_POLL_S)
            newer = self.engine.endpoints()
            if newer != found:
                found, changed_s = newer, time.monotonic()
        return found

    def wait_for(self, name: str, kind: EndpointKind, timeout_s: float) -> list[Endpoint]:
        """Return the endpoints of a topic or service; an empty list if none appears in time."""
        end_s = time.monotonic() + timeout_s
        while True:
            found = [each for each in self.engine.endpoints() if each.name == name and each.kind is kind]
            if found or time.monotonic() > end_s:
                return found
            time.sleep(_POLL_S)

    def message(self, type_name: str, announced: str = "") -> Ros2Message:
        """Return a definition, after comparing its hash with an announced one.

        Raises:
            NotFound: the type or an embedded type is unknown.
            PiprosError: the hash differs, or the definition is invalid.
        """
        message = self._catalog.message(_checked(type_name, "msg"))
        if announced and self._has_hashes and announced != message_hash(message, self._catalog.message):
            raise PiprosError(
                f"the node's definition of {type_name} differs from that of ROS 2 "
                f"{self._catalog.distribution.value}; set --distro, or pass the package's folder with --msgs"
            )
        return message

    def service(self, type_name: str) -> Ros2Service:
        """Return a definition. Raises NotFound if it or an embedded type is unknown."""
        return self._catalog.service(_checked(type_name, "srv"))

    def parts(self, service: Ros2Service) -> PartHashes:
        """Return the hashes that endpoints of a service announce."""
        if not self._has_hashes:
            return PartHashes()
        request, response = (
            message_hash(part, self._catalog.message) for part in (service.request, service.response)
        )
        return PartHashes(request, response)

    def hash_of(self, message: Ros2Message) -> str:
        """Return the hash that endpoints of a topic announce."""
        return message_hash(message, self._catalog.message) if self._has_hashes else ""

    def decode(self, payload: bytes | memoryview, message: Ros2Message) -> dict[str, Any]:
        """Return the fields of a message; see `pipros_rosbag2.interfaces.cdr.decode`."""
        return decode(payload, message, self._catalog.message)

    def encode(self, values: object, message: Ros2Message) -> bytes:
        """Return CDR; see `pipros_rosbag2.interfaces.cdr.encode`."""
        return encode(values, message, self._catalog.message)

    def shown(
        self, values: dict[str, Any], message: Ros2Message, *, no_arrays: bool, is_whole: bool
    ) -> dict[str, Any]:
        """Return a message with shortened arrays and texts, as `ros2 topic echo` prints it."""

        def single(value: Any, base: str) -> Any:
            if isinstance(value, dict):
                return self.shown(value, self._catalog.message(base), no_arrays=no_arrays, is_whole=is_whole)
            if isinstance(value, str) and len(value) > TRUNCATED and not is_whole:
                return f"{value[:TRUNCATED]}..."
            return value

        found = {}
        for field in message.fields if values else ():
            value, kind = values[field.name], field.type
            if kind.form is Form.SINGLE:
                found[field.name] = single(value, kind.base)
            elif no_arrays:
                base = {"float64": "double", "float32": "float"}.get(
                    kind.base, kind.base.replace("/msg/", "/")
                )
                length = f"array type: {base}[{len(value)}]" if kind.form is Form.ARRAY else ""
                found[field.name] = f"<{length or f'sequence type: {base}, length: {len(value)}'}>"
            else:
                kept = [single(each, kind.base) for each in (value if is_whole else value[:TRUNCATED])]
                found[field.name] = kept + ["..."] * (len(kept) < len(value))
        return found

    def python_text(self, values: dict[str, Any], message: Ros2Message) -> str:
        """Return a message as Python would create it: `std_msgs.msg.String(data='hello')`."""

        def text(value: Any, base: str) -> str:
            return (
                self.python_text(value, self._catalog.message(base))
                if isinstance(value, dict)
                else repr(value)
            )

        parts = []
        for field in message.fields if values else ():
            value, base = values[field.name], field.type.base
            items = f"[{', '.join(text(each, base) for each in value)}]" if isinstance(value, list) else ""
            parts.append(f"{field.name}={items or text(value, base)}")
        return f"{message.type.replace('/', '.')}({', '.join(parts)})"


def _checked(type_name: str, kind: str) -> str:
    if re.fullmatch(rf"\w+/{kind}/\w+", type_name, re.ASCII) is None:
        raise InvalidName(f"a type must have the form package/{kind}/Name, got [{listed(type_name)}]")
    return type_name


@dataclass(frozen=True, slots=True)
class Named:
    """A topic, service or action.

    Attributes:
        first: its publishers, or servers.
        second: its subscribers, or clients.
    """

    name: str
    types: tuple[str, ...]
    first: tuple[Endpoint, ...]
    second: tuple[Endpoint, ...]

    @property
    def is_hidden(self) -> bool:
        """Whether a part of the name starts with `_`, which ROS 2 does not list."""
        return any(part.startswith("_") for part in self.name.split("/"))


def topics(endpoints: Iterable[Endpoint]) -> list[Named]:
    """Return the topics by name."""
    return _named(endpoints, _PUBLISHERS, _SUBSCRIBERS)


def services(endpoints: Iterable[Endpoint]) -> list[Named]:
    """Return the services by name, including those of actions, which are hidden."""
    return _named(endpoints, _SERVERS, _CLIENTS)


def actions(endpoints: Iterable[Endpoint]) -> list[Named]:
    """Return the actions by name."""
    goals = (each for each in endpoints if each.name.endswith(_SEND_GOAL))
    return services(
        replace(each, name=each.name.removesuffix(_SEND_GOAL), type=each.type.removesuffix("_SendGoal"))
        for each in goals
    )


def _named(endpoints: Iterable[Endpoint], first: EndpointKind, second: EndpointKind) -> list[Named]:
    found: dict[str, list[Endpoint]] = {}
    for each in endpoints:
        if each.kind in (first, second):
            found.setdefault(each.name, []).append(each)
    return [
        Named(
            name,
            tuple(sorted({each.type for each in ends})),
            tuple(each for each in ends if each.kind is first),
            tuple(each for each in ends if each.kind is second),
        )
        for name, ends in sorted(found.items())
    ]


def topic_of(view: DomainView, name: str, timeout_s: float) -> tuple[str, str, list[Endpoint]]:
    """Return the type, its announced hash and the publishers of a topic.

    Raises:
        NotFound: no publisher or subscriber appears in time.
        PiprosError: the endpoints have different types.
    """
    publishers = view.wait_for(name, _PUBLISHERS, timeout_s)
    ends = publishers or view.wait_for(name, _SUBSCRIBERS, 0)
    if not ends:
        raise NotFound(f"topic [{name}] does not appear to be published yet")
    types = sorted({each.type for each in ends})
    if len(types) > 1:
        raise PiprosError(f"topic [{name}] has several types: {', '.join(types)}")
    return types[0], ends[0].type_hash, publishers


ANY_PUBLISHER: Final = TopicQos(Reliability.BEST_EFFORT)
"""The QoS of a subscriber that matches every publisher."""
