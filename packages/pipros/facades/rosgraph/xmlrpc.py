"""An XML-RPC server for programs that implement a node themselves. Facade of `pipros.net.rpc_server`."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.interruptible_wait import wait_in_slices
from pipros.net import address as _address
from pipros.net.loop import BackgroundLoop
from pipros.net.rpc_server import RpcServer
from rosgraph.names import isstring as isstring
from rosgraph.network import create_local_xmlrpc_uri

_log = logging.getLogger("xmlrpc")


class XmlRpcHandler:
    """Base class of the handlers of `XmlRpcNode`. Peers can call every public method of a subclass."""

    def _ready(self, uri: str) -> None:
        """Handle the start. Called with the URI once the server accepts requests."""

    def _shutdown(self, reason: str) -> None:
        """Handle the shutdown. Called when the server shuts down."""


class XmlRpcNode:
    """XML-RPC server that dispatches calls to a handler. After the start, `uri` is the server's address.

    Methods run one at a time in the server's thread, so they must not wait for each other.
    """

    def __init__(
        self,
        port: int | str = 0,
        rpc_handler: XmlRpcHandler | None = None,
        on_run_error: Callable[[Exception], None] | None = None,
    ) -> None:
        self.handler = rpc_handler
        self.port = int(port or 0)
        self.uri: str | None = None
        self.server: RpcServer | None = None
        self.on_run_error = on_run_error
        self.is_shutdown = False
        self._ended = threading.Event()
        self._loop = BackgroundLoop("xmlrpc node")

    def start(self) -> None:
        """Start serving in a background thread. Returns once `uri` is set.

        Raises:
            OSError: the port is in use, and `on_run_error` is not set.
        """
        environment = Environment.from_os()
        host = _address.bind_host(environment)
        self.server = RpcServer(
            _methods_of(self.handler), host=host, port=self.port or environment.port_range or 0
        )
        self._loop.start()
        try:
            self._loop.run(self.server.start())
        except OSError as error:
            self._loop.stop()
            self.server = None
            if self.on_run_error is None:
                raise
            self.on_run_error(error)
            return
        self.port = self.server.port
        self.set_uri(_uri(environment, host, self.port))
        if self.handler is not None and self.uri is not None:
            self.handler._ready(self.uri)

    def run(self) -> None:
        """Start serving and block until `shutdown`."""
        self.start()
        while not self.is_shutdown and self.server is not None:
            wait_in_slices(self._ended.wait, None)

    def set_uri(self, uri: str) -> None:
        """Set `uri`."""
        self.uri = uri

    def shutdown(self, reason: str) -> None:
        """Shut the server down. May be called repeatedly."""
        server, self.server = self.server, None
        self.is_shutdown = True
        self._ended.set()
        if server is None:
            return
        _log.debug("shutting down %s: %s", self.uri, reason)
        self._loop.run(server.stop())
        self._loop.stop()
        if self.handler is not None:
            self.handler._shutdown(reason)


def _methods_of(handler: XmlRpcHandler | None) -> dict[str, Callable[..., Any]]:
    """Return the table of public methods. Peers can call only these methods."""
    names = [] if handler is None else [name for name in dir(type(handler)) if not name.startswith("_")]
    return {name: getattr(handler, name) for name in names if callable(getattr(handler, name))}


def _uri(environment: Environment, bound_host: str, port: int) -> str:
    advertised = environment.advertised_address()
    if advertised is None and _address.is_loopback(bound_host):
        return _address.uri(bound_host, port)
    return create_local_xmlrpc_uri(port)
