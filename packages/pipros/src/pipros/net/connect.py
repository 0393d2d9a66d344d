"""Open connections with blocking calls that another thread can interrupt."""

from __future__ import annotations

import os
import socket
import time

from pipros.basics.errors import Interrupted
from pipros.basics.posix import require_sockets
from pipros.net import sockets
from pipros.net.address import address_here
from pipros.net.lookup import Lookups, process_lookups

SLICE_S = 0.1
"""Interval at which a wait for a connection checks whether it was interrupted."""


class Connector:
    """An attempt to connect, which `interrupt` can end at any time."""

    def __init__(self, lookups: Lookups | None = None) -> None:
        """Resolve host names with `lookups`, which defaults to the process-wide lookups."""
        self.is_interrupted = False
        self._lookups = lookups

    def interrupt(self) -> None:
        """Make `connect` raise Interrupted, within about a tenth of a second."""
        self.is_interrupted = True

    def connect(
        self, host: str, port: int, deadline: float | None = None, limit_s: float | None = None
    ) -> socket.socket:
        """Return a blocking socket connected to the first of the host's addresses that accepts a connection.

        Args:
            host: a name or an address.
            port: the port.
            deadline: `time.monotonic()` time by which the lookup and the connection must finish.
            limit_s: the time limit for connecting to one address.

        Raises:
            OSError: the name cannot be resolved, or none of its addresses accepts a connection.
            TimeoutError: the deadline or `limit_s` passed.
            Interrupted: `interrupt` was called.
            NeedsSockets: Python runs in a browser.
        """
        require_sockets()
        host, port = address_here(host, port)
        found = (self._lookups or process_lookups()).find(
            host, port, deadline=deadline, is_cancelled=lambda: self.is_interrupted, type=socket.SOCK_STREAM
        )
        failure = OSError(f"the name {host} has no address")
        for family, kind, protocol, _, address in found:
            until = None if limit_s is None else time.monotonic() + limit_s
            if deadline is not None:
                until = deadline if until is None else min(until, deadline)
            try:
                with sockets.closed_on_error(socket.socket(family, kind, protocol)) as sock:
                    self._connect(sock, address, until)
            except OSError as error:
                failure = error
            else:
                return sock
        raise failure

    def _connect(self, sock: socket.socket, address: tuple[object, ...], until: float | None) -> None:
        if self.is_interrupted:
            raise Interrupted("the connection was interrupted")
        left_s = SLICE_S if until is None else until - time.monotonic()
        if left_s <= 0:
            raise TimeoutError("no response in time")
        # The first slice uses the socket's own timeout, in C, because a local peer accepts within
        # microseconds.
        sock.settimeout(min(left_s, SLICE_S))
        try:
            sock.connect(address)
        except TimeoutError as error:
            if error.errno is not None:  # the system has given up; the timeout of a slice has no errno
                raise
            self._wait(sock, until)
        sock.settimeout(None)

    def _wait(self, sock: socket.socket, until: float | None) -> None:
        """Wait for the connection in interruptible slices. Raises the same errors as `connect`."""
        while True:
            if self.is_interrupted:
                raise Interrupted("the connection was interrupted")
            left_s = SLICE_S if until is None else until - time.monotonic()
            if sockets.wait_writable(sock, min(max(left_s, 0.0), SLICE_S)):
                break
            if left_s <= 0:
                raise TimeoutError("no response in time")
        if error := sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
            raise OSError(error, os.strerror(error))
