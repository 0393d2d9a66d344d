"""XML-RPC servers based on Python's standard library, for several concurrent clients.

`rosgraph.xmlrpc.XmlRpcNode` does not need them: it uses the server of pipros' nodes and master.
"""

from __future__ import annotations

import logging
import socketserver
import sys
from typing import Any
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

from rosgraph.network import use_ipv6

_logger = logging.getLogger("xmlrpc")


class SilenceableXMLRPCRequestHandler(SimpleXMLRPCRequestHandler):
    """Request handler that keeps connections open and does not log requests."""

    protocol_version = "HTTP/1.1"

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002  # its name in the standard library
        """Do nothing."""


class ThreadingXMLRPCServer(socketserver.ThreadingMixIn, SimpleXMLRPCServer):
    """Server that uses one thread per connection."""

    daemon_threads = True

    def __init__(self, addr: tuple[str, int], log_requests: bool = True) -> None:
        if use_ipv6():
            from socket import AF_INET6

            self.address_family = AF_INET6
        super().__init__(
            addr,
            requestHandler=SilenceableXMLRPCRequestHandler,
            logRequests=bool(log_requests),
            allow_none=False,
        )

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Log the exception of a connection instead of printing it."""
        _logger.exception("error in connection from %s (%s)", client_address, request)


__all__ = ["SilenceableXMLRPCRequestHandler", "ThreadingXMLRPCServer"]

if sys.platform != "win32" and hasattr(socketserver, "ForkingMixIn"):
    __all__ += ["ForkingXMLRPCServer"]

    class ForkingXMLRPCServer(socketserver.ForkingMixIn, SimpleXMLRPCServer):
        """Server that uses one process per connection."""

        def __init__(
            self,
            addr: tuple[str, int],
            request_handler: type[SimpleXMLRPCRequestHandler] = SilenceableXMLRPCRequestHandler,
            log_requests: bool = True,
        ) -> None:
            super().__init__(addr, requestHandler=request_handler, logRequests=bool(log_requests))
