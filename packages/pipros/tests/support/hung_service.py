"""A service whose server completes the handshake and never replies to a call."""

from __future__ import annotations

import socket
import threading
from contextlib import suppress
from typing import Any
from xmlrpc.client import ServerProxy

from pipros.wire.header import HeaderReader, encode_header


class HungService:
    """A service that is registered at a master. `close` closes its connections, but does not unregister it.

    Attributes:
        name: the name of the service.
        open_calls: number of open connections with an unanswered call.
    """

    def __init__(self, master_uri: str, name: str, type_name: str, md5sum: str) -> None:
        self.name = name
        self._reply = encode_header({"callerid": "/hung", "type": type_name, "md5sum": md5sum})
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=100)
        self._connections: set[socket.socket] = set()
        self._lock = threading.Lock()
        self.open_calls = 0
        threading.Thread(target=self._accept, daemon=True).start()
        uri = f"rosrpc://127.0.0.1:{self._listener.getsockname()[1]}"
        master: Any = ServerProxy(master_uri)
        assert master.registerService("/hung", name, uri, "http://127.0.0.1:9/")[0] == 1
        master("close")()

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        reader = HeaderReader(100_000)
        self._connections.add(connection)
        fields = None
        with connection, suppress(OSError):
            while fields is None:
                if not (data := connection.recv(4096)):
                    return
                fields = reader.feed(data)
            connection.sendall(self._reply)
            if "probe" in fields:
                return
            self._count(1)
            try:
                while connection.recv(4096):
                    pass
            finally:
                self._count(-1)
        self._connections.discard(connection)

    def _count(self, change: int) -> None:
        with self._lock:
            self.open_calls += change

    def close(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for connection in list(self._connections):
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
