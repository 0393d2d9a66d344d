"""Parse a node's responses to `getBusInfo` and `getBusStats`: its connections and their traffic.

Performs no I/O. Source: http://wiki.ros.org/ROS/Slave_API and, where that page is silent, the
behaviour of genuine nodes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from pipros.basics.printable import printable


class BusConnection(NamedTuple):
    """A connection, as reported by the node at one of its ends.

    Attributes:
        peer: the name or API URI of the node at the other end.
        direction: `i` (inbound), `o` (outbound) or `b` (both).
        topic: the topic or service.
        id: identifier of the connection in `getBusStats`.
        transport: `TCPROS`, or the name of another protocol, such as `UDPROS`.
        is_established: False while the node is still trying to connect.
        remark: description of the sockets; empty if the node does not send a description.
    """

    peer: str
    direction: str
    topic: str
    id: str = ""
    transport: str = "TCPROS"
    is_established: bool = True
    remark: str = ""


class SentCount(NamedTuple):
    """The messages and bytes that a node reports having sent over a connection."""

    messages: float
    bytes: float


def rows_of(answer: Any, method: str) -> list[Any]:
    """Return the unparsed rows from `[1, text, rows]`, the response to `method`.

    Raises:
        ValueError: the response is malformed, or reports an error.
    """
    if not isinstance(answer, list) or len(answer) != 3 or answer[0] != 1 or not isinstance(answer[2], list):
        raise ValueError(f"{method} must return [1, text, list], got {printable(answer, 80)}")
    return answer[2]


def statistics_of(answer: Any) -> list[Any]:
    """Return the rows in a `getBusStats` response. roscpp returns only the rows, without code and text.

    Raises:
        ValueError: the response is malformed, or reports an error.
    """
    if isinstance(answer, list) and answer and all(isinstance(rows, list) for rows in answer):
        return answer
    return rows_of(answer, "getBusStats")


def read_row(row: object) -> BusConnection | None:
    """Parse one row `[id, peer, direction, transport, topic[, is established[, remark]]]`.

    Return None if the row is malformed.
    """
    if not isinstance(row, list) or len(row) < 5 or not all(isinstance(row[at], str) for at in (1, 2, 4)):
        return None
    is_established = bool(row[5]) if len(row) > 5 else True
    remark = str(row[6]) if len(row) > 6 else ""
    return BusConnection(row[1], row[2], row[4], str(row[0]), str(row[3]), is_established, remark)


def established(rows: object) -> Iterator[BusConnection]:
    """Yield the established connections in `getBusInfo` rows. Malformed rows are skipped."""
    for row in rows if isinstance(rows, list) else ():
        connection = read_row(row)
        if connection is not None and connection.is_established:
            yield connection


def sent_counts(rows: Sequence[Any]) -> Iterator[tuple[str, SentCount]]:
    """Yield the id and traffic of each outgoing connection in `getBusStats` rows. Malformed rows are skipped.

    The rows are `[publishers, subscribers, services]`; a publisher is `[topic, bytes, [[id, bytes, messages,
    connected], …]]`, or from roscpp `[topic, [[id, bytes, bytes of messages, messages, 0], …]]`.
    """
    for row in rows[0] if rows and isinstance(rows[0], list) else ():
        links = row[-1] if isinstance(row, list) and row else None
        for link in links if isinstance(links, list) else ():
            if not isinstance(link, list) or len(link) < 3:
                continue
            size, messages = link[1], link[3] if len(link) >= 5 else link[2]
            if _is_count(size) and _is_count(messages):
                yield str(link[0]), SentCount(messages, size)


def drop_counts(rows: Sequence[Any]) -> Iterator[tuple[str, int]]:
    """Yield each topic in a subscriber's `getBusStats` rows, with the number of dropped messages.

    A subscription is `[topic, [[id, bytes, dropped, connected], …]]`, or from roscpp `[topic, [[id, bytes,
    messages, dropped, 0], …]]`. rospy does not count dropped messages and reports -1, which counts as 0.
    """
    for row in rows[1] if len(rows) > 1 and isinstance(rows[1], list) else ():
        if not isinstance(row, list) or len(row) < 2 or not isinstance(row[-1], list):
            continue
        links = (link for link in row[-1] if isinstance(link, list) and len(link) >= 4)
        counts = (link[3] if len(link) >= 5 else link[2] for link in links)
        yield str(row[0]), int(sum(count for count in counts if _is_count(count)))


def _is_count(value: object) -> bool:
    """Return whether a value is a number >= 0 and < 2**63, which excludes infinity and NaN."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and 0 <= value < 2**63
