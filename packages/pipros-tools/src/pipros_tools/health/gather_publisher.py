"""Ask a node for the header and the first message of a topic that it publishes."""

from __future__ import annotations

import socket
import struct
import time

from pipros.basics.errors import PiprosError, Unreachable
from pipros.basics.printable import printable
from pipros.net.connect import Connector
from pipros.net.rpc_client import RpcClient, reason_of
from pipros.wire.handshake import WireType, request_topic_link
from pipros.wire.header import HeaderReader, encode_header
from pipros_tools.health.system_report import Failure, PublisherReport

CALLER_ID = "/pipros_doctor"
_STAMP_SHARE = 1 / 6
"""Share of the timeout during which to wait for a publisher's next message, to compare its stamp."""
_FIRST_BYTES = struct.Struct("<IIII")  # the length of the message, and its header's seq, secs and nsecs
_CHUNK_BYTES = 16 * 1024


def failure_of(problem: Exception) -> Failure:
    """Convert an exception raised by a call to a peer into a value for the checks."""
    cause: BaseException | None = problem if isinstance(problem, OSError) else problem.__context__
    if isinstance(problem, Unreachable):
        reason, cause = problem.reason, problem.__cause__ or problem.__context__
    elif isinstance(problem, OSError):
        reason = reason_of(problem)
    else:
        reason = printable(problem)
    return Failure(
        reason,
        is_unknown_host=isinstance(cause, socket.gaierror),
        is_refused=isinstance(cause, ConnectionRefusedError),
    )


def ask_publisher(topic: str, api: str, timeout_s: float) -> PublisherReport:
    """Connect to a publisher as a subscriber does, without registering, and read its connection header."""
    try:
        with RpcClient(api, timeout_s=timeout_s) as client:
            answer = client.call("requestTopic", CALLER_ID, topic, [["TCPROS"]])
    except (PiprosError, ValueError) as problem:
        return PublisherReport(failure=failure_of(problem))
    try:
        code, text, (_, host, port) = answer
        host, port = str(host), int(port)
    except (TypeError, ValueError):
        text = answer[1] if isinstance(answer, list) and len(answer) > 1 else answer
        return PublisherReport(failure=Failure(printable(text)))
    if code != 1:
        return PublisherReport(failure=Failure(printable(text)))
    address = f"{host}:{port}"
    try:
        return _shake_hands(topic, host, port, timeout_s)
    except (OSError, PiprosError) as problem:
        return PublisherReport(address, failure_of(problem))


def _shake_hands(topic: str, host: str, port: int, timeout_s: float) -> PublisherReport:
    deadline = time.monotonic() + timeout_s
    with Connector().connect(host, port, deadline) as sock:
        sock.settimeout(timeout_s)
        request = request_topic_link(topic, CALLER_ID, WireType("*", "*"), tcp_nodelay=True)
        sock.sendall(encode_header(request))
        reader = HeaderReader()
        fields = None
        while fields is None:
            sock.settimeout(max(deadline - time.monotonic(), 0.001))
            data = sock.recv(_CHUNK_BYTES)
            if not data:
                raise ConnectionResetError("it closed the connection without a response")
            fields = reader.feed(data)
        if "error" in fields:
            return PublisherReport(f"{host}:{port}", Failure(printable(fields["error"])))
        # a latched message may be old
        has_stamp = fields.get("latching") != "1" and begins_with_header(fields.get("message_definition", ""))
        stamp = _stamp_offset(sock, reader.rest, timeout_s * _STAMP_SHARE) if has_stamp else None
    return PublisherReport(
        f"{host}:{port}", None, printable(fields.get("type", "")), printable(fields.get("md5sum", "")), stamp
    )


def begins_with_header(definition: object) -> bool:
    """Return whether the first field of a message is a std_msgs/Header."""
    for line in str(definition).splitlines():
        words = line.partition("#")[0].split()
        if words and "=" not in line.partition("#")[0]:
            return words[0] in ("Header", "std_msgs/Header", "roslib/Header")
    return False


def _stamp_offset(sock: socket.socket, begun: bytes, timeout_s: float) -> float | None:
    """Return the next message's stamp minus this machine's clock, in s; None without a message or a stamp."""
    data = begun
    until = time.monotonic() + timeout_s
    while len(data) < _FIRST_BYTES.size:
        left = until - time.monotonic()
        if left <= 0:
            return None
        sock.settimeout(left)
        try:
            more = sock.recv(_FIRST_BYTES.size - len(data))
        except OSError:
            return None
        if not more:
            return None
        data += more
    _, _, secs, nsecs = _FIRST_BYTES.unpack_from(data)
    return secs + nsecs / 1e9 - time.time() if secs or nsecs else None
