"""An `xmlrpc.client.ServerProxy` with a time limit, for facades that must return a `ServerProxy`."""

from __future__ import annotations

from http.client import HTTPConnection
from typing import Any, Final
from xmlrpc.client import ServerProxy, Transport

CALL_S: Final = 30.0
"""Time limit for connecting, and for each wait for data from the server."""


class _TimedTransport(Transport):
    def __init__(self, timeout_s: float) -> None:
        super().__init__()
        self._timeout_s = timeout_s

    def make_connection(self, host: Any) -> HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._timeout_s
        return connection


def server_proxy(uri: str, timeout_s: float = CALL_S) -> ServerProxy:
    """Return a proxy whose calls raise `TimeoutError` if the server is silent for longer than `timeout_s`.

    Raises:
        OSError: the scheme of the URI is not `http`, the only scheme in ROS.
    """
    if not uri.startswith("http://"):
        raise OSError(f"the URI of an XML-RPC server must start with http://, got {uri}")
    return ServerProxy(uri, transport=_TimedTransport(timeout_s))
