"""Zenoh keys of the fleet protocol.

The second part of every key is the name of the member that publishes to the key or answers its queries.

    pipros/<member>/live/<version>/<instance>     liveliness token: the member is present
    pipros/<member>/directory                     its directory document, sent on change and on request
    pipros/<member>/wanted/<other>                topics wanted from <other>, sent on change and on request
    pipros/<member>/t/<topic>                     messages of one of its topics
    pipros/<member>/in/<other>/<topic>            messages for a topic of another member
    pipros/<member>/s/<caller>/<service>          calls to one of its services by another member
    pipros/<member>/get/<caller>                  reads of its parameters by another member
    pipros/<member>/set/<caller>                  changes to its parameters by another member
    pipros/<member>/definition/<type>             the definition of a message type
    pipros/<member>/statistics                    its counters
    pipros/router/history/<member>[/<file>]       the list of files that a router recorded, or one of them

A question whose key does not name the asker is asked as `pipros/<member>/ask/<asker>/...`; see `asked`. A
router can therefore restrict a member to keys below `pipros/<its name>/`, and to questions and calls in its
name, and whoever answers can give each asker a share.
"""

from __future__ import annotations

import re
from typing import Final
from urllib.parse import quote, unquote

from pipros.basics.errors import InvalidName
from pipros.basics.names import is_legal_base
from pipros.basics.printable import printable

AGENT_PREFIX: Final = "/pipros_fleet_"
"""Prefix of the node names of agents; the member's name follows."""

ROOT: Final = "pipros"
VERSION: Final = 2
"""Protocol version. Members with another version are reported and otherwise ignored."""
EVERY: Final = "**"
"""Pattern for all topics or services. Not a legal ROS name."""
_CALLS: Final = ("s", "get", "set", "wanted")
"""Kinds of questions whose keys have the asker in third place."""
_INSTANCE: Final = re.compile(r"[0-9a-f]{16}")


def member_name(text: str) -> str:
    """Return the name of a member, which must be a legal ROS name without slashes.

    Raises:
        InvalidName: the name is not legal.
    """
    if not is_legal_base(text):
        raise InvalidName(
            f"[{printable(text)}] is not a legal name for a member: it must begin with a letter, "
            "followed by letters, digits and underscores"
        )
    return text


def mangled(name: str) -> str:
    """Return a global ROS name as part of a key.

    >>> mangled("/camera/image raw")
    'camera/image%20raw'
    """
    if name == EVERY:
        return name
    return "/".join(quote(part, safe="") for part in name.strip("/").split("/") if part)


def unmangled(part: str) -> str:
    """Return the global ROS name in a key.

    >>> unmangled("camera/image%20raw")
    '/camera/image raw'
    """
    return "/" + unquote(part)


def pattern_of(members: str) -> str:
    """Return the key part for a member name pattern. Illegal characters become underscores.

    >>> pattern_of("robot*"), pattern_of("*"), pattern_of("robot1")
    ('robot$*', '*', 'robot1')
    """
    parts = [re.sub(r"[^A-Za-z0-9_]", "_", part) for part in re.split(r"\*+", members)]
    return "*" if not any(parts) and len(parts) > 1 else "$*".join(parts) or "_"


def live(member: str, version: int | str = "*", instance: str = "*") -> str:
    return f"{ROOT}/{member}/live/{version}/{instance}"


def directory(member: str) -> str:
    return f"{ROOT}/{member}/directory"


def wanted(member: str, other: str) -> str:
    return f"{ROOT}/{member}/wanted/{other}"


def topic(member: str, name: str) -> str:
    return f"{ROOT}/{member}/t/{mangled(name)}"


def into(member: str, other: str, name: str) -> str:
    return f"{ROOT}/{member}/in/{other}/{mangled(name)}"


def service(member: str, caller: str, name: str) -> str:
    return f"{ROOT}/{member}/s/{caller}/{mangled(name)}"


def parameters(member: str, verb: str, caller: str) -> str:
    """Return the key for `caller`'s requests for parameters. `verb` is `get` or `set`."""
    return f"{ROOT}/{member}/{verb}/{caller}"


def definition(member: str, kind: str) -> str:
    """Return the key of a type's definition. `kind` may be `*` for all types."""
    return f"{ROOT}/{member}/definition/{quote(kind, safe='*')}"


def statistics(member: str) -> str:
    return f"{ROOT}/{member}/statistics"


def history(member: str, file: str = "") -> str:
    """Return the key of one recorded file, or of the list of files if `file` is empty."""
    return f"{ROOT}/router/history/{member}{'/' if file else ''}{file}"


def asked(key: str, asker: str) -> str:
    """Return the key with which a member asks for what a key names, or a pattern of such keys.

    >>> asked("pipros/r1/statistics", "operator"), asked("pipros/r1/get/operator", "operator")
    ('pipros/r1/ask/operator/statistics', 'pipros/r1/get/operator')
    """
    root, member, kind, *rest = key.split("/")
    return key if kind in _CALLS else "/".join((root, member, "ask", asker, kind, *rest))


def asker_of(key: str) -> tuple[str, str]:
    """Return who asks with a key, and what `asked` got.

    >>> asker_of("pipros/r1/ask/operator/statistics"), asker_of("pipros/r1/get/operator")
    (('operator', 'pipros/r1/statistics'), ('operator', 'pipros/r1/get/operator'))
    """
    match key.split("/"):
        case [root, member, "ask", asker, *rest]:
            return asker, "/".join((root, member, *rest))
        case [_, _, kind, asker, *_] if kind in _CALLS:
            return asker, key
    return "", key


def parts(key: str) -> tuple[str, str, list[str]] | None:
    """Return a key's member, kind and remaining parts, or None if it belongs to another protocol.

    >>> parts("pipros/r1/s/operator/arm/move")
    ('r1', 's', ['operator', 'arm', 'move'])
    """
    root, *rest = key.split("/")
    if root != ROOT or len(rest) < 2 or not is_legal_base(rest[0]):
        return None
    return rest[0], rest[1], rest[2:]


def read_live(key: str) -> tuple[str, int, str] | None:
    """Return the member, version and instance of a liveliness token, or None if it is malformed."""
    match parts(key):
        case (member, "live", [version, instance]) if version.isdecimal() and len(version) < 6:
            return (member, int(version), instance) if _INSTANCE.fullmatch(instance) else None
    return None
