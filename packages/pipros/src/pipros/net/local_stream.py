"""Unix streams between nodes on the same machine: names, permissions and connecting.

A node that listens for TCPROS connections also listens at a name in Linux's abstract socket namespace. Unix
streams carry the bytes of TCPROS unchanged. For large messages, the kernel does half as much work as for TCP,
and there are no delays caused by TCP.

- Topics negotiate the stream in `requestTopic`: a subscriber offers `["PIPROSLOCAL", "v1", <token>]` after
  `["TCPROS"]`, and a publisher with the same token replies `["PIPROSLOCAL", "v1", <name>]`. Genuine nodes
  ignore unknown protocols; others, such as those of rosnodejs, read only the first.
- Services have no negotiation, so the name is derived from the address that the server registers.

Like ports, abstract names belong to a network namespace: they can be reached from other mount, PID and IPC
namespaces, but not from other network namespaces. Both ends check the user at the other end. If anything
fails, TCP is used. `PIPROS_LOCAL=off` turns Unix streams off.
"""

from __future__ import annotations

import os
import socket
import sys
from functools import cache
from typing import Final

from pipros.net.local_socket import HAS_LOCAL_SOCKETS, is_own, peer_user
from pipros.net.sockets import closed_on_error

PROTOCOL: Final = "PIPROSLOCAL"
VERSION: Final = "v1"

SWITCH: Final = "PIPROS_LOCAL"
"""The environment variable that turns Unix streams off if it is `off`."""
MEMORY_SWITCH: Final = "PIPROS_SHARED_MEMORY"
"""The environment variable that turns shared memory off if it is `off`."""

_PREFIX: Final = "pipros-"
_DIGEST_BYTES: Final = 16
_BACKLOG: Final = 1024
_UNMAPPED_USER: Final = 65534
"""The user id that the kernel reports for users who do not exist in this user namespace."""


def is_enabled() -> bool:
    """Return whether this process uses Unix streams."""
    return HAS_LOCAL_SOCKETS and os.environ.get(SWITCH) != "off"


def shares_memory() -> bool:
    """Return whether this process shares memory with other nodes on this machine."""
    return os.environ.get(MEMORY_SWITCH) != "off" and is_enabled() and hasattr(os, "memfd_create")


def is_local(sock: socket.socket) -> bool:
    """Return whether a connection is a Unix stream."""
    return sys.platform == "linux" and sock.family == socket.AF_UNIX


def transport_of(sock: socket.socket) -> str:
    """Return the name of a topic link's protocol in `getBusInfo`."""
    return PROTOCOL if is_local(sock) else "TCPROS"


@cache
def machine_token() -> str | None:
    """Return a string that all processes in this network namespace share, or None if it is unknown.

    It serves only to avoid futile attempts to connect, and does not prove where a peer runs.
    """
    try:
        with open("/proc/sys/kernel/random/boot_id", "rb") as file:
            boot = file.read(100)
        namespace = os.stat("/proc/self/ns/net").st_ino
    except OSError:
        return None
    return _digest(boot + b"%d" % namespace)


def offer() -> list[list[str]]:
    """Return the protocols to offer in `requestTopic`. TCPROS is first, for nodes that read only one."""
    token = machine_token() if is_enabled() else None
    return [["TCPROS"], *([[PROTOCOL, VERSION, token]] if token else [])]


def is_offer_from_here(protocol: object) -> bool:
    """Return whether a protocol in `requestTopic` offers a Unix stream from this network namespace."""
    return is_enabled() and protocol == [PROTOCOL, VERSION, machine_token()]


def name_of(service_uri: str) -> str:
    """Return the abstract socket name of the node whose services have the URI `rosrpc://HOST:PORT`."""
    return f"{_PREFIX}{_digest(service_uri.rstrip('/').encode())}"


def listen(name: str) -> socket.socket | None:
    """Return a non-blocking listening socket at an abstract name.

    Return None if Unix streams are turned off, or if the name is in use or cannot be opened.
    """
    if sys.platform != "linux" or not is_enabled():
        return None
    server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        server.bind(f"\0{name}")
        server.listen(_BACKLOG)
    except OSError:
        server.close()
        return None
    server.setblocking(False)
    return server


def connect(name: str) -> socket.socket:
    """Return a non-blocking connection to an abstract name.

    Raises:
        OSError: no process listens there in this network namespace, the backlog is full, the listening
            process belongs to another user, or the name, which a publisher may have sent, is not a node's.
    """
    if sys.platform != "linux":
        raise OSError("this system has no abstract sockets")
    if not (name.startswith(_PREFIX) and len(name) == len(_PREFIX) + 2 * _DIGEST_BYTES):
        raise PermissionError("the name does not belong to a node")  # but perhaps to a display or a bus
    with closed_on_error(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)) as sock:
        sock.setblocking(False)
        sock.connect(f"\0{name}")
        if not is_from_same_user(sock):
            raise PermissionError("the listening process belongs to another user")
        return sock


def is_from_same_user(sock: socket.socket) -> bool:
    """Return whether the process at the other end belongs to this user or to root.

    A user who does not exist in this user namespace cannot be identified, so the result is False.
    """
    return is_own(sock) and peer_user(sock) != _UNMAPPED_USER


def _digest(data: bytes) -> str:
    try:
        # importing hashlib loads OpenSSL, which delays the start of each node by 1 ms
        from _blake2 import blake2b
    except ImportError:
        from hashlib import blake2b

    return blake2b(data, digest_size=_DIGEST_BYTES).hexdigest()
