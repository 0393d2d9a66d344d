"""Functions for stream sockets that can be called on all operating systems."""

from __future__ import annotations

import contextlib
import errno
import os
import select
import socket
import struct
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING
from weakref import WeakSet

from pipros.basics.errors import PiprosError
from pipros.basics.posix import call_in_children, descriptor_limit
from pipros.basics.uri import host_and_port
from pipros.net.timings import LINK_TIMINGS, LinkTimings

if TYPE_CHECKING:
    from pipros.basics.ports import PortRange

_DONTWAIT: int = getattr(socket, "MSG_DONTWAIT", 0)
_QUICKACK: int = getattr(socket, "TCP_QUICKACK", 0)

GATHER_LIMIT = 512
"""Maximum number of buffers in one gathered write (IOV_MAX on Linux; macOS and Windows allow no fewer)."""

_ATTEMPTS = 10
"""Maximum number of ports that are tried to find one that is free on all addresses."""

_TCP_INFO = struct.Struct("=8B13I")
"""The start of Linux's `struct tcp_info`: bytes 2 and 3 count unanswered retransmissions and probes;
the 13th of the 32-bit numbers is the age of the last acknowledgement in milliseconds.
"""


class NoFreePort(PiprosError, OSError):
    """No port in a range can be opened."""


@contextlib.contextmanager
def closed_on_error(sock: socket.socket) -> Iterator[socket.socket]:
    """Close a socket if the block raises any exception."""
    try:
        yield sock
    except BaseException:
        sock.close()
        raise


def listen(host: str, port: int | PortRange = 0, backlog: int = 128) -> socket.socket:
    """Return a non-blocking listening TCP socket. Port 0 selects a free port; `::` also accepts IPv4."""
    if not isinstance(port, int):
        return listen_all([host], port, backlog)[0]
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with closed_on_error(socket.socket(family, socket.SOCK_STREAM)) as server:
        if hasattr(socket, "SO_EXCLUSIVEADDRUSE"):  # Windows: SO_REUSEADDR would share the port
            server.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
        else:
            server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            server.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 0)
        server.bind((host, port))
        server.listen(backlog)
        server.setblocking(False)
    return server


def listen_all(hosts: Sequence[str], port: int | PortRange = 0, backlog: int = 128) -> list[socket.socket]:
    """Return listening sockets that use the same port on several addresses.

    Port 0 selects a port that is free on all addresses. A range selects its first such port.

    Raises:
        NoFreePort: no port in the range can be opened.
        OSError: the port is in use, or an address does not belong to this machine.
    """
    if not isinstance(port, int):
        return _listen_in_range(hosts, port, backlog)
    attempts = 1 if port else _ATTEMPTS
    while True:
        attempts -= 1
        opened: list[socket.socket] = []
        try:
            for host in hosts:
                opened.append(listen(host, opened[0].getsockname()[1] if opened else port, backlog))
        except OSError:
            for server in opened:
                server.close()
            if not opened or not attempts:
                raise
        else:
            return opened


def with_other_loopback(hosts: Sequence[str]) -> list[str]:
    """Return the addresses, plus `::1` or `127.0.0.1` if they cover only the other loopback address.

    Clients may resolve `localhost` to either. A loopback address that this machine lacks is not added.
    """
    result = list(dict.fromkeys(hosts))
    if {"127.0.0.1", "0.0.0.0"} & {*hosts} and not {"::1", "::"} & {*hosts}:  # noqa: S104 # only compared
        result.append("::1")
    elif "::1" in hosts and not {"127.0.0.1", "0.0.0.0"} & {*hosts}:  # noqa: S104 # only compared
        result.append("127.0.0.1")
    return [each for each in result if each in hosts or _is_here(each)]


def _is_here(address: str) -> bool:
    try:
        listen(address).close()
    except OSError:
        return False
    return True


def _listen_in_range(hosts: Sequence[str], ports: PortRange, backlog: int) -> list[socket.socket]:
    is_reserved = False
    for port in ports:
        try:
            return listen_all(hosts, port, backlog)
        except PermissionError:  # Windows also raises this for a port in use
            is_reserved = is_reserved or port < 1024
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
    from pipros.net.port_holders import port_holders

    reserved = "; ports below 1024 need privileges" if is_reserved else ""
    holders = f". In use: {holders}" if (holders := port_holders(ports)) else ""
    raise NoFreePort(
        f"no free port in {ports} on {' and '.join(hosts)}{reserved}{holders}. Widen the range, or "
        "end programs that use its ports"
    )


def connections_that_fit(share: float = 0.5) -> int:
    """Return the number of connections that a share of the process's file descriptors allows; at least 32."""
    return max(32, int(min(descriptor_limit(), 32768) * share))


def close_in_children(descriptors: Callable[[], Iterable[int]]) -> None:
    """Close sockets in forked children, so that a port closes when the process that opened it ends.

    `descriptors` is called in each child. The descriptor numbers stay in use in the child, because objects
    refer to them.
    """

    def replace_by_null() -> None:
        nothing = os.open(os.devnull, os.O_RDWR)
        for descriptor in descriptors():
            os.dup2(nothing, descriptor, inheritable=False)
        os.close(nothing)

    call_in_children(replace_by_null)


_not_for_children: WeakSet[socket.socket] = WeakSet()


def keep_from_children(sock: socket.socket) -> None:
    """Close a connection in forked children: they and this process would read each other's answers."""
    _not_for_children.add(sock)


def _close_in_child() -> None:
    for sock in [*_not_for_children]:
        sock.close()


call_in_children(_close_in_child)


def prepare(sock: socket.socket, *, no_delay: bool = True, timings: LinkTimings = LINK_TIMINGS) -> None:
    """Set the socket options for a TCPROS link. A Unix stream needs none.

    A peer that vanishes without closing the connection is detected after about idle + interval * count
    seconds, as specified by `timings`. Small messages are sent at once if `no_delay` is true.
    """
    if sock.family not in (socket.AF_INET, socket.AF_INET6):
        return
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, int(no_delay))
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (
        ("TCP_KEEPIDLE", timings.keepalive_idle_s),
        ("TCP_KEEPALIVE", timings.keepalive_idle_s),  # the name on macOS
        ("TCP_KEEPINTVL", timings.keepalive_interval_s),
        ("TCP_KEEPCNT", timings.keepalive_count),
    ):
        if hasattr(socket, name):
            sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


def is_unanswered(sock: socket.socket, limit_s: float) -> bool:
    """Return True if the peer has not acknowledged retransmitted data for longer than `limit_s`.

    Keepalive checks only idle connections, and the system takes a quarter of an hour to close a connection
    with unacknowledged data. Returns False for a live peer that does not read, because the peer still
    acknowledges probes; it ignores only a probe that follows another too closely (`tcp_invalid_ratelimit`).
    Always False on systems other than Linux.
    """
    if sys.platform != "linux":
        return False
    with contextlib.suppress(OSError, struct.error):
        info = _TCP_INFO.unpack(sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _TCP_INFO.size))
        sent_again, probes, age_ms = int(info[2]), int(info[3]), int(info[-1])
        return sent_again + probes >= 3 and age_ms > limit_s * 1000
    return False


def is_nearly_drained(sock: socket.socket) -> bool:
    """Return True if at most a quarter of the send buffer is unacknowledged.

    Always True on systems other than Linux.
    """
    if sys.platform != "linux":
        return True
    import fcntl
    import termios

    with contextlib.suppress(OSError):
        (unacknowledged,) = struct.unpack("i", fcntl.ioctl(sock, termios.TIOCOUTQ, bytes(4)))
        return bool(unacknowledged <= sock.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF) // 4)
    return True


def acknowledge(sock: socket.socket) -> None:
    """Acknowledge received data at once, on systems that support it (Linux)."""
    if _QUICKACK:
        with contextlib.suppress(OSError):  # the socket was closed in the meantime
            sock.setsockopt(socket.IPPROTO_TCP, _QUICKACK, 1)


def share_packets(sock: socket.socket, *, share: bool) -> None:
    """Set whether small messages wait to share a packet while data is unacknowledged (Nagle's algorithm).

    Waiting messages are sent at once when `share` becomes False.
    """
    with contextlib.suppress(OSError):  # the socket was closed in the meantime
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, int(not share))


def is_idle(sock: socket.socket) -> bool:
    """Return False if the connection is closed, or the peer sent bytes that have not been read."""
    return sock.fileno() >= 0 and not wait_readable(sock, 0.0)


def has_left(sock: socket.socket) -> bool:
    """Return whether the peer has closed the connection, even if not all of its data has been read.

    Always False on systems other than Linux.
    """
    if sys.platform != "linux":
        return False
    poll = select.poll()
    poll.register(sock, select.POLLRDHUP)
    return bool(poll.poll(0))


def receive_now(sock: socket.socket, buffer: memoryview) -> int:
    """Receive available bytes from a blocking socket without waiting; return 0 at the end of the stream.

    Raises:
        BlockingIOError: no bytes are available.
    """
    if not _DONTWAIT and not select.select([sock], [], [], 0)[0]:
        raise BlockingIOError
    return sock.recv_into(buffer, 0, _DONTWAIT)


def send_gathered(sock: socket.socket, buffers: Sequence[bytes | memoryview]) -> int:
    """Write several buffers in one call; return the number of bytes that the socket accepted."""
    if sys.platform == "win32":
        return sock.send(b"".join(buffers))
    return sock.sendmsg(buffers)


def wait_writable(sock: socket.socket, timeout_s: float) -> bool:
    """Wait until the socket is writable or has failed; return False after the timeout."""
    return _wait(sock, timeout_s, is_write=True)


def wait_readable(sock: socket.socket, timeout_s: float) -> bool:
    """Wait until the socket is readable or its stream has ended; return False after the timeout."""
    return _wait(sock, timeout_s, is_write=False)


def _wait(sock: socket.socket, timeout_s: float, *, is_write: bool) -> bool:
    if sys.platform != "win32" and hasattr(select, "poll"):
        poll = select.poll()  # select() cannot watch descriptor numbers above 1023
        poll.register(sock, select.POLLOUT if is_write else select.POLLIN)
        return bool(poll.poll(timeout_s * 1000))
    reading, writing = ([], [sock]) if is_write else ([sock], [])
    return any(
        select.select(reading, writing, writing, timeout_s)
    )  # Windows reports a failed connect as an exceptional condition


def wait_any_writable(socks: Sequence[socket.socket], timeout_s: float) -> Sequence[socket.socket]:
    """Wait until at least one socket is writable or has failed, and return all such sockets.

    The result is empty if the timeout expires, or if all sockets are closed.
    """
    numbers = {number: sock for sock in socks if (number := sock.fileno()) >= 0}
    if not numbers:
        return []
    if sys.platform != "win32" and hasattr(select, "poll"):
        poll = select.poll()
        for number in numbers:
            poll.register(number, select.POLLOUT)
        return [numbers[number] for number, _ in poll.poll(timeout_s * 1000)]
    return select.select([], list(numbers.values()), [], timeout_s)[1]


def abort(sock: socket.socket) -> None:
    """End a connection, whose owner closes the socket. May be called repeatedly."""
    with contextlib.suppress(OSError):  # the socket is no longer connected
        sock.shutdown(socket.SHUT_RDWR)


def abort_blocked(sock: socket.socket) -> None:
    """End a connection, and wake the thread that is blocked on it. May be called repeatedly.

    An event loop must not know the socket: on Windows, it is closed.
    """
    abort(sock)
    if sys.platform == "win32":
        sock.close()  # there, a thread that is blocked ignores the shutdown


def local_port(sock: socket.socket) -> int:
    """Return the port of this end of a connection; 0 for a Unix stream, or if the connection has ended."""
    try:
        name = sock.getsockname()
    except OSError:
        return 0
    return int(name[1]) if isinstance(name, tuple) else 0


def peer_name(sock: socket.socket) -> str:
    """Return the `host:port` of the other end; `this machine` for a Unix stream, `?` if not connected."""
    try:
        name = sock.getpeername()
    except OSError:
        return "?"
    return host_and_port(name[0], name[1]) if isinstance(name, tuple) else "this machine"
