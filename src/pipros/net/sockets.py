"""What pipros asks of TCP sockets, and where operating systems differ on it."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import struct
import sys
from collections.abc import Callable, Iterable, Sequence

from pipros.wire.uri import host_and_port

_DONTWAIT: int = getattr(socket, "MSG_DONTWAIT", 0)
_QUICKACK: int = getattr(socket, "TCP_QUICKACK", 0)

#: The most buffers that one gathered write may take (IOV_MAX on Linux, macOS and Windows is no less).
GATHER_LIMIT = 512

#: A peer that vanished without a word is found after about idle + interval * count seconds.
KEEPALIVE_IDLE_S = 20
KEEPALIVE_INTERVAL_S = 5
KEEPALIVE_COUNT = 4
KEEPALIVE_LIMIT_S = KEEPALIVE_IDLE_S + KEEPALIVE_INTERVAL_S * KEEPALIVE_COUNT

#: How many ports are tried until one is free at all addresses.
_ATTEMPTS = 10

#: The beginning of Linux' `struct tcp_info`: bytes 2 and 3 count what was sent again, and probes, without
#: an answer; the 13th of the 32-bit numbers is the age of the last acknowledgement in milliseconds.
_TCP_INFO = struct.Struct("=8B13I")


def listen(host: str, port: int = 0, backlog: int = 128) -> socket.socket:
    """A listening TCP socket, non-blocking; port 0 takes a free one. `::` takes IPv4 connections as well."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    server = socket.socket(family, socket.SOCK_STREAM)
    try:
        if hasattr(socket, "SO_EXCLUSIVEADDRUSE"):  # Windows: SO_REUSEADDR would share the port
            server.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
        else:
            server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            server.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 0)
        server.bind((host, port))
        server.listen(backlog)
        server.setblocking(False)
    except BaseException:
        server.close()
        raise
    return server


def listen_all(hosts: Sequence[str], port: int = 0) -> list[socket.socket]:
    """Listening sockets at several addresses and the same port; port 0 takes one that is free at all."""
    attempts = 1 if port else _ATTEMPTS
    while True:
        attempts -= 1
        opened: list[socket.socket] = []
        try:
            for host in hosts:
                opened.append(listen(host, opened[0].getsockname()[1] if opened else port))
        except OSError:
            for server in opened:
                server.close()
            if not opened or not attempts:
                raise
        else:
            return opened


def connections_that_fit(share: float = 0.5) -> int:
    """How many connections a share of the process's descriptors is; the rest is for what else it opens."""
    try:
        import resource
    except ImportError:  # Windows, where sockets do not count as files
        return int(8192 * share)
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft == resource.RLIM_INFINITY or soft > 32768:
        soft = 32768
    return max(32, int(soft * share))


def let_go_in_children(descriptors: Callable[[], Iterable[int]]) -> None:
    """Has a forked child hold none of these sockets, so that a port closes with the process that opened it.

    `descriptors` is called in each child. Their numbers stay taken there: objects that know them are left.
    """

    def let_go() -> None:
        nothing = os.open(os.devnull, os.O_RDWR)
        for descriptor in descriptors():
            os.dup2(nothing, descriptor, inheritable=False)
        os.close(nothing)

    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=let_go)


def prepare(sock: socket.socket, *, no_delay: bool = True) -> None:
    """Sets what every TCPROS link wants: small messages at once, and vanished peers noticed."""
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, int(no_delay))
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (
        ("TCP_KEEPIDLE", KEEPALIVE_IDLE_S),
        ("TCP_KEEPINTVL", KEEPALIVE_INTERVAL_S),
        ("TCP_KEEPCNT", KEEPALIVE_COUNT),
    ):
        if hasattr(socket, name):
            sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


def is_unanswered(sock: socket.socket, limit_s: float) -> bool:
    """True when the peer has not acknowledged what was sent, and sent again, for longer than `limit_s`.

    Keepalive looks after idle connections only; one with data under way is given up by the system after
    a quarter of an hour. A peer that is alive but does not read acknowledges all the same, and is not meant.
    False where the system does not tell (it is not Linux).
    """
    if not sys.platform.startswith("linux"):
        return False
    with contextlib.suppress(OSError, struct.error):
        info = _TCP_INFO.unpack(sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _TCP_INFO.size))
        sent_again, probes, age_ms = int(info[2]), int(info[3]), int(info[-1])
        return sent_again + probes >= 2 and age_ms > limit_s * 1000
    return False


def is_nearly_drained(sock: socket.socket) -> bool:
    """True when the peer has acknowledged what was sent, but for a quarter of what the system holds at most.

    True where the system does not tell (it is not Linux).
    """
    if not sys.platform.startswith("linux"):
        return True
    import fcntl
    import termios

    with contextlib.suppress(OSError):
        (unacknowledged,) = struct.unpack("i", fcntl.ioctl(sock, termios.TIOCOUTQ, bytes(4)))
        return bool(unacknowledged <= sock.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF) // 4)
    return True


def acknowledge(sock: socket.socket) -> None:
    """Tells the sender at once what has arrived, where the system (Linux) can be asked to."""
    if _QUICKACK:
        with contextlib.suppress(OSError):  # closed meanwhile
            sock.setsockopt(socket.IPPROTO_TCP, _QUICKACK, 1)


def share_packets(sock: socket.socket, *, share: bool) -> None:
    """Whether small messages wait, while others are unacknowledged, to go out in one packet.

    Those that wait go out at once when `share` ends.
    """
    with contextlib.suppress(OSError):  # closed meanwhile
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, int(not share))


def receive_now(sock: socket.socket, room: memoryview) -> int:
    """Receives what is there from a blocking socket without waiting; 0 at the end of the stream.

    Raises:
        BlockingIOError: nothing is there.
    """
    if not _DONTWAIT and not select.select([sock], [], [], 0)[0]:
        raise BlockingIOError
    return sock.recv_into(room, 0, _DONTWAIT)


def send_gathered(sock: socket.socket, buffers: Sequence[bytes | memoryview]) -> int:
    """Writes several buffers in one call; returns how many bytes the socket took."""
    if hasattr(sock, "sendmsg"):
        return sock.sendmsg(buffers)
    return sock.send(b"".join(buffers))


def wait_writable(sock: socket.socket, timeout_s: float) -> bool:
    """Waits until a write would take something (or fail at once); False when the time is over."""
    return _wait(sock, timeout_s, is_write=True)


def wait_readable(sock: socket.socket, timeout_s: float) -> bool:
    """Waits until there is something to receive, or the end; False when the time is over."""
    return _wait(sock, timeout_s, is_write=False)


def _wait(sock: socket.socket, timeout_s: float, *, is_write: bool) -> bool:
    if hasattr(select, "poll"):  # select() itself cannot watch descriptors above 1024
        poll = select.poll()
        poll.register(sock, select.POLLOUT if is_write else select.POLLIN)
        return bool(poll.poll(timeout_s * 1000))
    reading, writing = ([], [sock]) if is_write else ([sock], [])
    return any(select.select(reading, writing, writing, timeout_s))  # Windows: where connecting failed


def wait_any_writable(socks: Sequence[socket.socket], timeout_s: float) -> Sequence[socket.socket]:
    """Waits until a write to one of the sockets would take something (or fail at once).

    Returns those of which this is true: none when the time is over, or when all are closed.
    """
    numbers = {number: sock for sock in socks if (number := sock.fileno()) >= 0}
    if not numbers:
        return []
    if hasattr(select, "poll"):
        poll = select.poll()
        for number in numbers:
            poll.register(number, select.POLLOUT)
        return [numbers[number] for number, _ in poll.poll(timeout_s * 1000)]
    return select.select([], list(numbers.values()), [], timeout_s)[1]


def abort(sock: socket.socket) -> None:
    """Ends a connection now, waking whoever is blocked on it. Harmless when repeated."""
    with contextlib.suppress(OSError):  # not connected any more, which is what was wanted
        sock.shutdown(socket.SHUT_RDWR)


def peer_name(sock: socket.socket) -> str:
    """`host:port` of the other end, or `?` when it is gone already."""
    try:
        name = sock.getpeername()
    except OSError:
        return "?"
    return host_and_port(name[0], name[1])
