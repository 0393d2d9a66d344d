"""Unix sockets that connect one user's programs, in a folder that others cannot write to. Linux only.

The path of a socket is limited to about a hundred bytes, but `ROS_HOME` may be longer. Sockets are therefore
opened relative to the folder's descriptor, below `/proc/self/fd`.
"""

from __future__ import annotations

import contextlib
import os
import select
import socket
import struct
import sys
from typing import Final

from pipros.basics.cache_files import CacheFolder, Untrusted
from pipros.basics.posix import user_id

HAS_LOCAL_SOCKETS: Final = sys.platform == "linux"

_NO_SOCKETS: Final = "this system has no Unix sockets that report the user at the other end"

_CREDENTIALS: Final = struct.Struct("3i")
"""The layout of `struct ucred`: process, user and group IDs."""
_BACKLOG: Final = 16


def listen(folder: CacheFolder, name: str) -> socket.socket:
    """Return a listening socket at `name` in a folder.

    The folder is created if necessary. An existing socket with that name is replaced.

    Raises:
        Untrusted: other users could write to the folder.
        OSError: the socket cannot be created, for example on a file system without sockets.
    """
    if not HAS_LOCAL_SOCKETS:  # raised first, because Windows cannot open the folder either
        raise OSError(_NO_SOCKETS)
    unfinished = f".{name}.{os.urandom(6).hex()}"
    inside = folder.enter(creates=True)
    try:
        server = _socket()
        try:
            server.bind(f"/proc/self/fd/{inside}/{unfinished}")
            try:
                os.chmod(unfinished, 0o600, dir_fd=inside)
                server.listen(_BACKLOG)
                os.replace(unfinished, name, src_dir_fd=inside, dst_dir_fd=inside)
            except BaseException:
                os.unlink(unfinished, dir_fd=inside)
                raise
        except BaseException:
            server.close()
            raise
        return server
    finally:
        os.close(inside)


def connect(folder: CacheFolder, name: str, timeout_s: float) -> socket.socket:
    """Return a connection to the socket at `name` in a folder.

    Raises:
        Untrusted: another user listens there, or could write to the folder.
        OSError: the socket does not exist, or its program has ended.
    """
    if not HAS_LOCAL_SOCKETS:
        raise OSError(_NO_SOCKETS)
    inside = folder.enter()
    client = _socket()
    try:
        client.settimeout(timeout_s)
        client.connect(f"/proc/self/fd/{inside}/{name}")
        if not is_own(client):
            raise Untrusted(f"the socket {name} belongs to another user")
    except BaseException:
        client.close()
        raise
    finally:
        os.close(inside)
    return client


def remove_dead(folder: CacheFolder) -> None:
    """Remove the sockets of programs that have been killed. Ignore errors."""
    with contextlib.suppress(OSError):
        for name in folder.names():
            try:
                connect(folder, name, 1.0).close()
            except ConnectionRefusedError:
                folder.remove(name)
            except OSError:
                continue


def is_own(connection: socket.socket) -> bool:
    """Return whether the process at the other end belongs to this user or to root."""
    return peer_user(connection) in (0, user_id())


def peer_user(connection: socket.socket) -> int | None:
    """Return the user id of the process at the other end, or None if the system does not report it."""
    if sys.platform != "linux":
        return None
    found = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    return int(_CREDENTIALS.unpack(found)[1])


def has_hung_up(connection: socket.socket) -> bool:
    """Return whether the other end has closed the connection, not only its own direction."""
    if sys.platform != "linux":
        return False
    poll = select.poll()
    poll.register(connection, 0)
    return any(events & select.POLLHUP for _, events in poll.poll(0))


def _socket() -> socket.socket:
    if sys.platform != "linux":
        raise OSError(_NO_SOCKETS)
    return socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
