"""A rosbridge server in the test's process, and a simple WebSocket client."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from types import TracebackType
from typing import Any

from websockets.sync.client import connect

from pipros.node import Node
from pipros_bridges.rosbridge.server import ServerOptions, WebSocketServer

TIMEOUT_S = 60.0


@contextmanager
def rosbridge_server(node: Node, **options: Any) -> Iterator[str]:
    """Run a server on a free port, and yield its URL."""
    server = WebSocketServer(node, ServerOptions(port=0, **options))
    port = server.start()
    try:
        yield f"ws://127.0.0.1:{port}"
    finally:
        server.close()


class RosbridgeClient:
    """A client that sends and receives operations as dictionaries."""

    def __init__(self, url: str, **options: Any) -> None:
        self._open = ExitStack()
        options = {"close_timeout": 1, "open_timeout": TIMEOUT_S, **options}
        self.socket = self._open.enter_context(connect(url, max_size=None, **options))

    def __enter__(self) -> RosbridgeClient:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.close()

    def send(self, op: str, **values: Any) -> None:
        self.socket.send(json.dumps({"op": op, **values}))

    def receive(self, decode: Callable[[Any], Any] = json.loads) -> Any:
        """Return the next operation. Raises TimeoutError after `TIMEOUT_S`."""
        return decode(self.socket.recv(TIMEOUT_S))

    def wait_for(self, op: str, **values: Any) -> Any:
        """Return the next operation `op` that has these values. Other operations are skipped."""
        end = time.monotonic() + TIMEOUT_S
        while time.monotonic() < end:
            found = self.receive()
            if found["op"] == op and values.items() <= found.items():
                return found
        raise AssertionError(f"no {op} with {values}")

    def call(self, service: str, args: Any = None, **values: Any) -> Any:
        """Call a service, and return the response."""
        identity = f"call:{service}"
        self.send("call_service", service=service, id=identity, args=args, **values)
        return self.wait_for("service_response", id=identity)
