"""Requests between one user's programs on a machine: JSON over Unix sockets in a folder. Linux only.

A program listens on a socket named after its process id. It responds only to this user and root, as
identified by the operating system. Each connection carries one request and one response; the response to a
refused request is `{"error": "…"}`. A request whose sender no longer waits for the response is ignored: the
program may have been suspended meanwhile, and the sender has been told that the request failed.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, Final

from pipros.basics.cache_files import CacheFolder
from pipros.basics.errors import PiprosError
from pipros.net import local_socket
from pipros.packages import cache_folder

REQUEST_BYTES: Final = 65_536
_TIMEOUT_S: Final = 5.0
_PAUSE_S: Final = 0.1
_CHUNK_BYTES: Final = 65_536


class LocalFailed(PiprosError):
    """A program has ended, does not respond, or refuses a request.

    Attributes:
        has_ended: whether the program has ended.
    """

    def __init__(self, reason: str, *, has_ended: bool = False) -> None:
        self.has_ended = has_ended
        super().__init__(reason)


class LocalServer:
    """The socket of this process in a folder, with a thread that answers requests."""

    def __init__(self, kind: str, answer: Callable[[Any], Mapping[str, Any]]) -> None:
        """Store the arguments; `start` creates the socket.

        Args:
            kind: name of the folder below `$ROS_HOME/pipros`.
            answer: function that takes a request (any JSON value) and returns the response, a JSON object.
                If it raises an error about the request (`PiprosError`, `ValueError`, `LookupError`,
                `TypeError`, …), the response contains the error's text.
        """
        self._folder = _folder(kind)
        self._answer = answer
        self._name = str(os.getpid())
        self._server: socket.socket | None = None
        self._is_closed = threading.Event()

    def start(self) -> None:
        """Create the socket, and answer requests in another thread.

        Raises:
            OSError: the socket cannot be created, or this system does not support Unix sockets.
        """
        local_socket.remove_dead(self._folder)
        self._server = local_socket.listen(self._folder, self._name)
        threading.Thread(target=self._serve, args=(self._server,), name="control", daemon=True).start()

    def stop(self) -> None:
        """Remove the socket. May be called repeatedly, and before `start`."""
        server, self._server = self._server, None
        if server is None:
            return
        self._is_closed.set()
        with contextlib.suppress(OSError):
            self._folder.remove(self._name)
        with contextlib.suppress(OSError):
            server.shutdown(socket.SHUT_RDWR)  # makes the thread's `accept` return
        server.close()

    def _serve(self, server: socket.socket) -> None:
        while True:
            try:
                connection, _ = server.accept()
            except OSError:  # the socket has been closed, or this process has too many open files
                if self._is_closed.wait(_PAUSE_S):
                    return
                continue
            with connection, contextlib.suppress(OSError):
                connection.settimeout(_TIMEOUT_S)
                if local_socket.is_own(connection):
                    connection.sendall(json.dumps(self._response(connection)).encode())

    def _response(self, connection: socket.socket) -> Mapping[str, Any]:
        try:
            text = _received(connection, REQUEST_BYTES, f"the limit is {REQUEST_BYTES} bytes")
            return {} if local_socket.has_hung_up(connection) else self._answer(json.loads(text))
        except (PiprosError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
            return {"error": str(error) or type(error).__name__}


def running(kind: str) -> list[str]:
    """Return the process ids of this user's programs that have sockets in a folder, as decimal strings.

    A process that was killed may still be listed.

    Raises:
        OSError: the folder cannot be read, or other users could write to it.
    """
    try:
        return sorted(name for name in _folder(kind).names() if name.isdecimal())
    except FileNotFoundError:
        return []


def ask(kind: str, process: str, request: Any, limit_bytes: int, advice: str = "") -> Mapping[str, Any]:
    """Send a request to the program with a process id, and return its response.

    May block for several seconds.

    Args:
        limit_bytes: maximum size of the response.
        advice: how to raise this limit, for the error text.

    Raises:
        LocalFailed: the process has ended, does not respond, or refuses the request.
    """
    try:
        with local_socket.connect(_folder(kind), process, _TIMEOUT_S) as connection:
            connection.sendall(json.dumps(request).encode())
            connection.shutdown(socket.SHUT_WR)
            answer = json.loads(_received(connection, limit_bytes, advice))
    except (FileNotFoundError, ConnectionError):
        raise LocalFailed(f"process {process} has ended", has_ended=True) from None
    except (OSError, ValueError, RecursionError) as error:
        raise LocalFailed(f"process {process} does not answer: {error}") from None
    if not isinstance(answer, dict) or "error" in answer:
        problem = answer.get("error") if isinstance(answer, dict) else "malformed answer"
        raise LocalFailed(str(problem))
    return answer


def _received(connection: socket.socket, limit: int, advice: str) -> bytes:
    """Return all bytes that the other side sends until it closes the stream.

    Raises:
        ValueError: the other side sends more than `limit` bytes.
        TimeoutError: the other side does not close the stream in time, however much it sends.
    """
    text = bytearray()
    end_s = time.monotonic() + _TIMEOUT_S
    while chunk := connection.recv(_CHUNK_BYTES):
        connection.settimeout(max(end_s - time.monotonic(), 0.001))
        text += chunk
        if len(text) > limit:
            raise ValueError(f"the message is too long; {advice}")
    return bytes(text)


def _folder(kind: str) -> CacheFolder:
    return CacheFolder(cache_folder(kind))
