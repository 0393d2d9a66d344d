"""Clients of nodes' APIs that keep their connections open between calls."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Collection, Iterator

from pipros.net.rpc_client import RpcClient

BUS_ANSWER_BYTES = 8 * 1024 * 1024
"""Limit: a node's report on its connections, for tools that show the graph. Beyond it, the node is shown as
unresponsive.
"""

MAX_KEPT = 256
"""Maximum number of nodes whose connections are kept. Each call to a further node opens a new connection."""


class NodeClients:
    """Clients of nodes' APIs, one per node. Thread-safe."""

    def __init__(self, timeout_s: float) -> None:
        """Store the settings. Clients are created on demand.

        Args:
            timeout_s: time limit for one call.
        """
        self._timeout_s = timeout_s
        self._clients: dict[str, RpcClient] = {}
        self._lock = threading.Lock()

    @contextlib.contextmanager
    def client(self, uri: str) -> Iterator[RpcClient]:
        """Provide the client for the node at a URI.

        Raises:
            ValueError: the URI is malformed.
        """
        with self._lock:
            client = self._clients.get(uri)
            if client is None and len(self._clients) < MAX_KEPT:
                client = self._clients[uri] = self._new(uri)
        if client is not None:
            yield client
            return
        with self._new(uri) as client:
            yield client

    def keep_only(self, uris: Collection[str]) -> None:
        """Close the connections to nodes whose URIs are not in `uris`."""
        with self._lock:
            gone = [self._clients.pop(uri) for uri in [*self._clients] if uri not in uris]
        for client in gone:
            client.close()

    def _new(self, uri: str) -> RpcClient:
        limit_bytes = BUS_ANSWER_BYTES
        return RpcClient(uri, timeout_s=self._timeout_s, answer_limit_bytes=limit_bytes)
