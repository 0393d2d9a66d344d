"""Fake nodes that only have a slave API, and servers that hang or send garbage."""

import contextlib
import os
import socket
import threading
from collections.abc import Callable, Mapping
from typing import Any
from xmlrpc.client import ServerProxy

from pipros.net.loop import BackgroundLoop
from pipros.net.rpc_server import RpcServer
from pipros.wire.header import HeaderReader, encode_header


class Served:
    """XML-RPC methods that a test serves, on an event loop of their own.

    Attributes:
        api: the address of the server, on `port`.
    """

    def __init__(self, methods: Mapping[str, Callable[..., Any]], **options: Any) -> None:
        self._loop = BackgroundLoop("methods of a test")
        self._loop.start()
        self._server = RpcServer(methods, **options)
        self._loop.run(self._server.start())
        self.port = self._server.port
        self.api = f"http://127.0.0.1:{self.port}/"

    def __enter__(self) -> "Served":
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """Refuse connections from now on."""
        self._loop.run(self._server.stop())
        self._loop.stop()


class FakeSlave(Served):
    """The slave API of a node, which records the calls of the master.

    Attributes:
        told: the method and parameters of each notification, in order.
        pid: the process id that `getPid` returns.
        named: number of calls of `getName`.
    """

    def __init__(
        self, *, name: str = "", pid: int | None = None, on_notice: Callable[[], Any] | None = None
    ) -> None:
        self.told: list[tuple[Any, ...]] = []
        self.pid = pid or os.getpid()
        self.named = 0
        self._name = name
        self._on_notice = on_notice
        super().__init__({
            "publisherUpdate": lambda *params: self._note("publisherUpdate", *params),
            "paramUpdate": lambda *params: self._note("paramUpdate", *params),
            "shutdown": lambda *params: self._note("shutdown", *params),
            "getPid": lambda _: [1, "", self.pid], "getName": lambda _: self._tell_name(),
        })  # fmt: skip

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


class _Listener:
    """A server that calls `serve` with each connection, in a thread."""

    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=100)
        self.port: int = self._listener.getsockname()[1]
        self._accepting = threading.Thread(target=self._accept, daemon=True)
        self._accepting.start()

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            self.serve(connection)

    def serve(self, connection: socket.socket) -> None:
        raise NotImplementedError

    def stop(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._accepting.join(30)  # the thread may still be about to serve a connection
        self._listener.close()


class SilentSlave(_Listener):
    """A server that accepts connections and never responds, like a hung node."""

    def __init__(self) -> None:
        self.connections: list[socket.socket] = []
        super().__init__()
        self.api = f"http://127.0.0.1:{self.port}/"

    def serve(self, connection: socket.socket) -> None:
        self.connections.append(connection)

    def stop(self) -> None:
        super().stop()
        for connection in self.connections:
            connection.close()


class GarbageServer(_Listener):
    """A server that sends the same bytes to every client, and closes the connection."""

    def __init__(self, reply: bytes) -> None:
        self._reply = reply
        super().__init__()

    def serve(self, connection: socket.socket) -> None:
        with connection, contextlib.suppress(OSError):
            connection.recv(65536)
            connection.sendall(self._reply)


class HungService(_Listener):
    """A service that is registered at a master, completes the handshake and never replies to a call.

    Attributes:
        name: the name of the service.
        open_calls: number of open connections with an unanswered call.
    """

    def __init__(self, master_uri: str, name: str, type_name: str, md5sum: str) -> None:
        self.name = name
        self._reply = encode_header({"callerid": "/hung", "type": type_name, "md5sum": md5sum})
        self._connections: set[socket.socket] = set()
        self._called: set[socket.socket] = set()
        super().__init__()
        master: Any = ServerProxy(master_uri)
        uri = f"rosrpc://127.0.0.1:{self.port}"
        assert master.registerService("/hung", name, uri, "http://127.0.0.1:9/")[0] == 1
        master("close")()

    @property
    def open_calls(self) -> int:
        return len(self._called)

    def serve(self, connection: socket.socket) -> None:
        self._connections.add(connection)
        threading.Thread(target=self._hang, args=(connection,), daemon=True).start()

    def _hang(self, connection: socket.socket) -> None:
        reader, fields = HeaderReader(100_000), None
        with connection, contextlib.suppress(OSError):
            while fields is None and (data := connection.recv(4096)):
                fields = reader.feed(data)
            if fields is not None:
                connection.sendall(self._reply)
            if fields is not None and "probe" not in fields:
                self._called.add(connection)
                while connection.recv(4096):
                    pass
        self._connections.discard(connection)
        self._called.discard(connection)

    def close(self) -> None:
        """Close the connections; the service stays registered."""
        self.stop()
        for connection in list(self._connections):
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
