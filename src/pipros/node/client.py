"""Calling services over TCPROS.

Source of the protocol: http://wiki.ros.org/ROS/TCPROS
"""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol
from urllib.parse import urlsplit
from weakref import WeakSet

from pipros.errors import PiprosError, ProtocolError, Refused
from pipros.net import sockets
from pipros.net.lookout import ANSWER_LOOK_S, Lookout
from pipros.net.master import MasterClient
from pipros.net.tcpros import HANDSHAKE_DEADLINE_S
from pipros.node.publisher import encoder
from pipros.node.service import ServiceClass
from pipros.node.subscriber import decoder
from pipros.wire.handshake import Interface, check_service_reply, request_service_link
from pipros.wire.header import HeaderReader, encode_header

if TYPE_CHECKING:
    from pipros.msg.base import Message

_pack_length = struct.Struct("<I").pack
_unpack_length = struct.Struct("<I").unpack_from
_HEADER_CHUNK_BYTES = 16 * 1024
_CHUNK_BYTES = 64 * 1024
_LARGEST_CHUNK_BYTES = 4 * 1024 * 1024


class ServiceFailed(PiprosError):
    """A service call brought no response: nobody there, refused, answered with an error, or broken."""


class CallTimeout(ServiceFailed):
    """A service call took longer than it was given."""


class Interruptible(Protocol):
    """What waits for a peer, and can be told to stop."""

    def interrupt(self) -> None: ...


class OpenCalls:
    """Calls under way, to be ended together; may be a part of others."""

    def __init__(self, part_of: OpenCalls | None = None) -> None:
        self._open: WeakSet[Interruptible] = WeakSet()
        self._lock = threading.Lock()
        self._is_interrupted = False
        if part_of is not None:
            part_of.add(self)

    def add(self, call: Interruptible) -> None:
        with self._lock:
            self._open.add(call)
            is_too_late = self._is_interrupted
        if is_too_late:
            call.interrupt()

    def remove(self, call: Interruptible) -> None:
        with self._lock:
            self._open.discard(call)

    def interrupt(self) -> None:
        """Ends every call under way, and those to come."""
        with self._lock:
            self._is_interrupted = True
            calls = list(self._open)
        for call in calls:
            call.interrupt()


class ServiceClient:
    """Calls one service. Calls of several threads go over connections of their own, unless persistent."""

    def __init__(
        self,
        service: str,
        service_class: ServiceClass,
        *,
        master: Callable[[], MasterClient],
        calls: OpenCalls,
        persistent: bool = False,
        headers: Mapping[str, str] | None = None,
    ) -> None:
        """Nothing is connected yet.

        Args:
            service: the global name.
            service_class: its class.
            master: the master to ask where the service is.
            calls: what to be interrupted with.
            persistent: keeps one connection for all calls.
            headers: reach the handler in the connection header.
        """
        self.calls = OpenCalls(part_of=calls)
        self.service = service
        self._interface = Interface(service_class._type, service_class._md5sum)
        self._decode = decoder(service_class._response_class)
        self._master = master
        self._persistent = persistent
        self._headers = headers
        # Outlives the connections: whether servers answer at once is learnt.
        self._lookout = Lookout(ANSWER_LOOK_S)
        self._kept: ServiceLink | None = None
        self._turn = threading.Lock()  # of the kept link

    def call(self, request: Message, timeout_s: float | None = None) -> Any:
        """Sends the request and returns the response.

        Raises:
            CallTimeout: there was none within `timeout_s`.
            ServiceFailed: nobody offers the service, or it answered with an error.
        """
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        if not self._persistent:
            link = self._connect(deadline)
            try:
                return self._decode(link.call(self.service, request, deadline))
            finally:
                self._close(link)
        with self._turn:
            if self._kept is None or self._kept.is_closed:  # broken by an earlier call: begin anew
                self._kept = self._connect(deadline)
            body = self._kept.call(self.service, request, deadline)
        return self._decode(body)

    def probe(self, timeout_s: float) -> None:
        """Asks whether a server really answers; raises ServiceFailed if not."""
        deadline = time.monotonic() + timeout_s
        interface = Interface("*", "*")
        link = ServiceLink(
            self._look_up(),
            self.service,
            self._master().caller_id,
            interface,
            deadline=deadline,
            probe=True,
            lookout=self._lookout,
        )
        link.close()

    def close(self) -> None:
        """Closes the kept connection of a persistent client; another call raises."""
        kept, self._kept = self._kept, None
        if kept is not None:
            self._close(kept)

    def _look_up(self) -> str:
        try:
            return self._master().lookup_service(self.service)
        except Refused:
            raise ServiceFailed(f"service [{self.service}] unavailable") from None
        except PiprosError as error:
            raise ServiceFailed(f"unable to contact master: {error}") from error

    def _connect(self, deadline: float | None) -> ServiceLink:
        uri = self._look_up()
        link = ServiceLink(
            uri,
            self.service,
            self._master().caller_id,
            self._interface,
            deadline=deadline,
            persistent=self._persistent,
            extra=self._headers,
            lookout=self._lookout,
        )
        self.calls.add(link)
        return link

    def _close(self, link: ServiceLink) -> None:
        self.calls.remove(link)
        link.close()


class ServiceLink:
    """A client's connection to a service server. One call at a time; not for several threads."""

    def __init__(
        self,
        uri: str,
        service: str,
        caller_id: str,
        interface: Interface,
        *,
        deadline: float | None,
        persistent: bool = False,
        probe: bool = False,
        extra: Mapping[str, str] | None = None,
        lookout: Lookout | None = None,
    ) -> None:
        """Connects and shakes hands.

        Raises:
            CallTimeout: the deadline (of `time.monotonic`) passed.
            ServiceFailed: nobody answers at `uri`, or the server refuses.
        """
        self._lookout = lookout or Lookout(ANSWER_LOOK_S)
        host, port = split_service_uri(uri)
        try:
            self.sock = socket.create_connection((host, port), _remaining(deadline, HANDSHAKE_DEADLINE_S))
        except OSError as error:
            raise _cannot_connect(service, error, deadline) from error
        try:
            sockets.prepare(self.sock)
            header = request_service_link(
                service, caller_id, interface, persistent=persistent, probe=probe, extra=extra
            )
            self.sock.settimeout(_remaining(deadline, HANDSHAKE_DEADLINE_S))
            self.sock.sendall(encode_header(header))
            self.sock.settimeout(None)
            self.fields, rest = self._read_header(deadline)
            self._rest: bytes | bytearray = rest
            check_service_reply(self.fields, f"{host}:{port}")
        except Refused as error:
            self.sock.close()
            raise ServiceFailed(
                f"unable to connect to service: remote error reported: {error.text}"
            ) from error
        except (OSError, ProtocolError) as error:
            self.sock.close()
            raise _cannot_connect(service, error, deadline) from error

    def call(self, service: str, request: Message, deadline: float | None) -> bytes:
        """Sends a request and returns the body of the response.

        Raises:
            CallTimeout: the deadline (of `time.monotonic`) passed; the link is closed.
            ServiceFailed: the server answered with an error, or the connection broke.
        """
        body = encoder(type(request))(request)
        try:
            self.sock.settimeout(_remaining(deadline))
            self.sock.sendall(b"".join((_pack_length(sum(map(len, body))), *body)))
            self.sock.settimeout(None)
            ok, reply = self._receive_reply(deadline)
        except TimeoutError as error:
            self.close()
            raise CallTimeout(f"service [{service}] did not answer in time") from error
        except (OSError, ProtocolError) as error:
            self.close()
            raise ServiceFailed(f"transport error completing service call: {error}") from error
        if not ok:
            raise ServiceFailed(f"service [{service}] responded with an error: {reply!r}")
        return reply

    def _read_header(self, deadline: float | None) -> tuple[Mapping[str, str], bytes]:
        reader = HeaderReader()
        last = time.monotonic() + HANDSHAKE_DEADLINE_S
        deadline = last if deadline is None else min(deadline, last)
        while True:
            data = self._lookout.receive(self.sock, _HEADER_CHUNK_BYTES, deadline)
            if not data:
                raise ProtocolError("the server closed the connection before it answered")
            fields = reader.feed(data)
            if fields is not None:
                return fields, reader.rest

    def _receive_reply(self, deadline: float | None) -> tuple[bool, bytes]:
        """The ok byte and the body; memory grows with what arrives, not with what was announced."""
        data = self._rest
        while len(data) < 5 or len(data) < 5 + _unpack_length(data, 1)[0]:
            missing = 5 + _unpack_length(data, 1)[0] - len(data) if len(data) >= 5 else 0
            most = min(max(missing, _CHUNK_BYTES), _LARGEST_CHUNK_BYTES)
            more = self._lookout.receive(self.sock, most, deadline)
            if not more:
                raise ProtocolError("unable to receive data from sender, check sender's logs for details")
            if not data:
                data = more
            else:
                data = bytearray(data) if not isinstance(data, bytearray) else data
                data += more
        end = 5 + _unpack_length(data, 1)[0]
        self._rest = bytes(data[end:])
        return data[0] == 1, bytes(data[5:end])

    def interrupt(self) -> None:
        """Ends a call that another thread waits for."""
        sockets.abort(self.sock)

    @property
    def is_closed(self) -> bool:
        return self.sock.fileno() < 0

    def close(self) -> None:
        sockets.abort(self.sock)
        self.sock.close()


def split_service_uri(uri: str) -> tuple[str, int]:
    """Host and port of `rosrpc://host:port`."""
    with contextlib.suppress(ValueError):
        parts = urlsplit(uri)
        if parts.scheme == "rosrpc" and parts.hostname and parts.port:
            return parts.hostname, parts.port
    raise ServiceFailed(f"protocol error: [{uri}] is no rosrpc URI")


def _cannot_connect(service: str, error: Exception, deadline: float | None) -> ServiceFailed:
    if deadline is not None and time.monotonic() >= deadline:
        return CallTimeout(f"service [{service}] did not answer in time")
    return ServiceFailed(f"unable to connect to service: {error}")


def _remaining(deadline: float | None, longest_s: float | None = None) -> float | None:
    """Seconds until the deadline, for a socket's time limit; raises TimeoutError when it has passed."""
    if deadline is None:
        return longest_s
    remaining = deadline - time.monotonic()
    if remaining <= 0:
        raise TimeoutError("the time is over")
    return remaining if longest_s is None else min(remaining, longest_s)
