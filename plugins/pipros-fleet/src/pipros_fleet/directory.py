"""The directory of a member: a JSON document, limited in size, that lists what the member offers."""

from __future__ import annotations

import json
import re
from dataclasses import asdict, dataclass
from typing import Any, Final

from pipros.basics.errors import LimitExceeded, ProtocolError
from pipros.basics.names import is_legal
from pipros.basics.printable import printable

FLEET_MEMBERS = 1000
"""Maximum number of other members that a member shows. Beyond it, a further member is shown when another has
left.
"""
FLEET_TOPICS = 5000
"""Maximum number of topics and services of these members, in total. Beyond it, some topics and services of
the members that offer most are not shown, and the names of these members are reported.
"""
FLEET_DIRECTORY_BYTES = 4 * 1024 * 1024
"""Maximum size of a member's directory of the topics and services that it offers, or of a request about
parameters. Beyond it, the directory is refused, and the member is not shown; the request is refused.
"""

_MD5: Final = re.compile(r"[0-9a-f]{32}")
_LONGEST_S: Final = 86_400.0
_TYPE: Final = re.compile(r"[A-Za-z]\w*/[A-Za-z]\w*", re.ASCII)


@dataclass(frozen=True, slots=True, order=True)
class DirectoryEntry:
    """A topic or service.

    Attributes:
        name: global name on the member's master.
        type, md5sum: as in connection headers.
        timeout_s: maximum duration of a call, for services.
    """

    name: str
    type: str
    md5sum: str
    timeout_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Directory:
    """The topics and services that a member offers.

    Attributes:
        member: the member's name.
        instance: identifies one run of its agent.
        revision: increases with each change.
        shared: topics that other members can receive.
        accepted: topics to which other members can publish.
        services: services that other members can call.
        has_parameters, sets_parameters: whether any rule may allow other members to read or set parameters.
    """

    member: str
    instance: str
    revision: int = 0
    shared: tuple[DirectoryEntry, ...] = ()
    accepted: tuple[DirectoryEntry, ...] = ()
    services: tuple[DirectoryEntry, ...] = ()
    has_parameters: bool = False
    sets_parameters: bool = False

    @property
    def size(self) -> int:
        """Number of topics and services."""
        return len(self.shared) + len(self.accepted) + len(self.services)


@dataclass(frozen=True, slots=True)
class TopicRequests:
    """The topics that a member requests from another member.

    Attributes:
        instance: identifies the run of the member's agent.
        revision: increases with each change, so that an outdated reply does not replace a newer message.
        topics: names on the other member's master.
    """

    instance: str
    revision: int = 0
    topics: frozenset[str] = frozenset()


def to_json(directory: Directory) -> bytes:
    """Encode a directory."""
    return json.dumps(asdict(directory), separators=(",", ":")).encode()


def from_json(content: bytes, member: str, limit_bytes: int | None = None) -> Directory:
    """Decode a member's directory. Entries with invalid names, types or MD5 sums are omitted.

    Raises:
        LimitExceeded: the directory is larger than `limit_bytes`, by default
            `FLEET_DIRECTORY_BYTES`.
        ProtocolError: the directory is malformed, or belongs to another member.
    """
    limit_bytes = FLEET_DIRECTORY_BYTES if limit_bytes is None else limit_bytes
    if len(content) > limit_bytes:
        raise LimitExceeded(
            f"the directory of [{member}] has {len(content)} bytes; the limit is {limit_bytes} bytes"
        )
    match read_json(content):
        case {"member": str(name), "instance": str(instance), "revision": int(revision), **rest}:
            pass
        case _:
            raise ProtocolError(f"the directory of [{member}] is malformed")
    if name != member:
        raise ProtocolError(f"the directory of [{member}] claims to be that of [{printable(name, 100)}]")
    return Directory(
        member,
        instance,
        revision,
        _entries(rest.get("shared")),
        _entries(rest.get("accepted")),
        _entries(rest.get("services")),
        rest.get("has_parameters") is True,
        rest.get("sets_parameters") is True,
    )


def read_json(content: bytes) -> Any:
    """Decode a JSON document from a peer.

    Return None if it is malformed, or larger than `FLEET_DIRECTORY_BYTES`: decoding stops all other threads.
    """
    try:
        return json.loads(content) if len(content) <= FLEET_DIRECTORY_BYTES else None
    except (ValueError, RecursionError):
        return None


def requests_to_json(requests: TopicRequests) -> bytes:
    """Encode requests."""
    document = {**asdict(requests), "topics": sorted(requests.topics)}
    return json.dumps(document, separators=(",", ":")).encode()


def requests_from_json(content: bytes, limit_bytes: int | None = None) -> TopicRequests | None:
    """Decode requests. Return None if they are malformed or too large."""
    limit_bytes = FLEET_DIRECTORY_BYTES if limit_bytes is None else limit_bytes
    match read_json(content) if len(content) <= limit_bytes else None:
        case {"instance": str(instance), "revision": int(revision), "topics": list(topics)}:
            return TopicRequests(
                instance, revision, frozenset(name for name in topics if isinstance(name, str))
            )
    return None


def _entries(values: object) -> tuple[DirectoryEntry, ...]:
    found = {}
    for value in values if isinstance(values, list) else ():
        match value:
            case {"name": str(name), "type": str(kind), "md5sum": str(md5sum)} if (
                name.startswith("/")
                and not name.endswith("/")
                and is_legal(name)
                and _TYPE.fullmatch(kind)
                and _MD5.fullmatch(md5sum)
            ):
                found[name] = DirectoryEntry(name, kind, md5sum, _timeout_s(value.get("timeout_s")))
    return tuple(sorted(found.values()))


def _timeout_s(value: object) -> float:
    is_usable = isinstance(value, (int, float)) and not isinstance(value, bool) and 0 <= value <= _LONGEST_S
    return float(value) if is_usable else 0.0  # type: ignore[arg-type]
