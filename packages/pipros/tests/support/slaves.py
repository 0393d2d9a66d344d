"""Fake nodes that only have a slave API, for tests of the master."""

from __future__ import annotations

import contextlib
import os
import socket
import threading
from collections.abc import Callable
from typing import Any

from pipros.net.loop import BackgroundLoop
from pipros.net.rpc_server import RpcServer


class FakeSlave:
    """The slave API of a node, which records the calls of the master.

    Attributes:
        told: the method and parameters of each notification, in order.
        pid: the process id that `getPid` returns.
        asked: number of calls of `getPid`.
        named: number of calls of `getName`.
    """

    def __init__(
        self, *, name: str = "", pid: int | None = None, on_notice: Callable[[], Any] | None = None
    ) -> None:
        self.told: list[tuple[Any, ...]] = []
        self.pid = pid or os.getpid()
        self.asked = self.named = 0
        self._name = name
        self._on_notice = on_notice
        self._loop = BackgroundLoop("fake slave")
        self._loop.start()
        self._server = RpcServer(
            {
                "publisherUpdate": lambda *params: self._note("publisherUpdate", *params),
                "paramUpdate": lambda *params: self._note("paramUpdate", *params),
                "shutdown": lambda *params: self._note("shutdown", *params),
                "getPid": lambda _: self._tell_pid(),
                "getName": lambda _: self._tell_name(),
            }
        )
        self._loop.run(self._server.start())
        self.api = f"http://127.0.0.1:{self._server.port}/"
        self.port = self._server.port

    def _tell_pid(self) -> list[Any]:
        self.asked += 1
        return [1, "", self.pid]

    def _tell_name(self) -> list[Any]:
        self.named += 1
        return [1, "", self._name] if self._name else [0, "", 0]

    def _note(self, *notice: Any) -> Any:
        self.told.append(notice)
        if self._on_notice:
            return self._on_notice()
        return [1, "", 0]

    def publishers(self) -> list[list[str]]:
        """Return the publisher lists received so far, in order."""
        return [notice[3] for notice in self.told if notice[0] == "publisherUpdate"]

    def stop(self) -> None:
        """Refuse connections from now on."""
        self._loop.run(self._server.stop())
        self._loop.stop()


class SilentSlave:
    """A server that accepts connections and never responds, like a hung node."""

    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=100)
        self.api = f"http://127.0.0.1:{self._listener.getsockname()[1]}/"
        self.connections: list[socket.socket] = []
        self._accepting = threading.Thread(target=self._accept, daemon=True)
        self._accepting.start()

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            self.connections.append(connection)

    def stop(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._accepting.join(30)  # the thread may still be about to store a connection
        self._listener.close()
        for connection in self.connections:
            connection.close()


class GarbageServer:
    """A server that sends the same bytes to every client, and closes the connection."""

    def __init__(self, reply: bytes) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=100)
        self.port = self._listener.getsockname()[1]
        self._reply = reply
        self._serving = threading.Thread(target=self._serve, daemon=True)
        self._serving.start()

    def _serve(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            with connection, contextlib.suppress(OSError):
                connection.recv(65536)
                connection.sendall(self._reply)

    def stop(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._serving.join(30)
        self._listener.close()
