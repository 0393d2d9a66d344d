"""The headers that both ends of a TCPROS connection exchange first, and the rules for refusing a connection.

This module performs no I/O: it takes headers and returns headers or a refusal. Sources:
http://wiki.ros.org/ROS/TCPROS and, for rules that are missing there, genuine rospy and roscpp. The connecting
end sends its header first. A refusal is a header with the single field `error`, after which the connection
closes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from pipros.basics.errors import ProtocolError, Refused
from pipros.basics.printable import printable

HANDSHAKE_S = 10.0
"""Limit: the time in which a TCPROS header or the beginning of an HTTP request must arrive; also the time in
which a peer to which the node connects must reply with its header. Beyond it, the connection is closed.
"""

ANY = "*"  # wildcard for an md5sum or a type


class WireType(NamedTuple):
    """A message or service type, in the form that both ends of a connection compare."""

    type: str
    md5sum: str
    definition: str = ""


def request_topic_link(
    topic: str, caller_id: str, interface: WireType, *, tcp_nodelay: bool
) -> dict[str, str]:
    """Return the header with which a subscriber requests a topic from a publisher."""
    return {
        "callerid": caller_id,
        "md5sum": interface.md5sum,
        "message_definition": interface.definition,
        "tcp_nodelay": "1" if tcp_nodelay else "0",
        "topic": topic,
        "type": interface.type,
    }


def accept_topic_link(topic: str, caller_id: str, interface: WireType, *, latching: bool) -> dict[str, str]:
    """Return the header with which a publisher accepts a subscriber."""
    return {
        "callerid": caller_id,
        "latching": "1" if latching else "0",
        "md5sum": interface.md5sum,
        "message_definition": interface.definition,
        "topic": topic,
        "type": interface.type,
    }


def request_service_link(
    service: str,
    caller_id: str,
    interface: WireType,
    *,
    persistent: bool = False,
    probe: bool = False,
    extra: Mapping[str, str] | None = None,
) -> dict[str, str]:
    """Return the header that a client sends to request a service, including the fields in `extra`."""
    fields = {"service": service, "md5sum": interface.md5sum, "callerid": caller_id}
    if persistent:
        fields["persistent"] = "1"
    if probe:
        fields["probe"] = "1"
    return {**fields, **(extra or {})}


def accept_service_link(
    service: str, caller_id: str, interface: WireType, *, request_type: str = "", response_type: str = ""
) -> dict[str, str]:
    """Return the header with which a service server accepts a client.

    The header includes the request and response types if they are given, because roscpp expects them.
    """
    fields = {
        "callerid": caller_id,
        "md5sum": interface.md5sum,
        "service": service,
        "type": interface.type,
    }
    if request_type:
        fields["request_type"] = request_type
        fields["response_type"] = response_type
    return fields


def refuse(reason: str) -> dict[str, str]:
    return {"error": reason}


def topic_refusal(fields: Mapping[str, str], interface: WireType) -> str | None:
    """Return why a publisher refuses the subscriber that sent `fields`, or None if it accepts the link.

    Only the md5sum is compared, so a type with another name but the same md5sum is accepted.
    """
    missing = _missing(fields, ("topic", "md5sum", "callerid"))
    if missing:
        return missing
    theirs = fields["md5sum"]
    if ANY in (theirs, interface.md5sum) or theirs == interface.md5sum:
        return None
    caller, topic, type_name = map(printable, (fields["callerid"], fields["topic"], fields.get("type", "?")))
    return (
        f"Client [{caller}] wants topic [{topic}] to have datatype/md5sum "
        f"[{type_name}/{printable(theirs)}], but our version has "
        f"[{interface.type}/{interface.md5sum}]. Dropping connection."
    )


def service_refusal(fields: Mapping[str, str], interface: WireType) -> str | None:
    """Return why a service server refuses the client that sent `fields`, or None if it accepts the client."""
    missing = _missing(fields, ("service", "md5sum", "callerid"))
    if missing:
        return missing
    theirs = fields["md5sum"]
    if ANY in (theirs, interface.md5sum) or theirs == interface.md5sum:
        return None
    caller, theirs = printable(fields["callerid"]), printable(theirs)
    return f"request from [{caller}]: md5sums do not match: [{theirs}] vs. [{interface.md5sum}]"


def check_topic_reply(fields: Mapping[str, str], interface: WireType, peer: str) -> None:
    """Check a publisher's reply header on the subscriber's side.

    Raises:
        Refused: the publisher refused the link. The error contains the publisher's text.
        ProtocolError: the reply lacks a field, or its md5sum differs from the requested one.
    """
    _raise_refusal(fields, peer)
    missing = _missing(fields, ("md5sum", "type"))
    if missing:
        raise ProtocolError(f"publisher {peer}: {missing}")
    if ANY not in (fields["md5sum"], interface.md5sum) and fields["md5sum"] != interface.md5sum:
        raise ProtocolError(
            f"publisher {peer} sends [{fields['type']}/{fields['md5sum']}], "
            f"but this node expects [{interface.type}/{interface.md5sum}]"
        )


def check_service_reply(fields: Mapping[str, str], peer: str) -> None:
    """Check a service server's reply header on the client's side.

    Raises the same errors as `check_topic_reply`.
    """
    _raise_refusal(fields, peer)
    missing = _missing(fields, ("callerid",))
    if missing:
        raise ProtocolError(f"service at {peer}: {missing}")


def _missing(fields: Mapping[str, str], required: Iterable[str]) -> str | None:
    for name in required:
        if not fields.get(name):
            return f"Missing required '{name}' field"
    return None


def _raise_refusal(fields: Mapping[str, str], peer: str) -> None:
    if "error" in fields:
        raise Refused(peer, -1, fields["error"])
