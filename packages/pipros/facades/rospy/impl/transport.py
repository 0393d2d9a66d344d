"""`rospy.impl.transport`: genuine rospy's connection classes.

pipros's connections are links from `pipros.net`. The classes here describe links, and serve as base classes
for other code.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "threading")

INBOUND = "i"
OUTBOUND = "o"
BIDIRECTIONAL = "b"

_numbers = itertools.count(1)


class Transport:
    """Base class of all connections.

    Attributes:
        transport_type: for example, `TCPROS`.
        direction: `i` (inbound), `o` (outbound) or `b` (both).
        name: the topic or service.
        id: number of the connection in this process.
        endpoint_id: the peer's caller ID or URI.
        local_endpoint, remote_endpoint: addresses and ports.
        stat_bytes, stat_num_msg: the numbers of bytes and messages transferred so far.
        done: True once the connection is closed.
    """

    transport_type = "UNKNOWN"

    def __init__(self, direction: str, name: str = "unnamed") -> None:
        self.name = name
        self.direction = direction
        self.done = False
        self.cleanup_cb: Callable[[Any], object] | None = None
        self.endpoint_id = ""
        self.id = next(_numbers)
        self.stat_bytes = 0
        self.stat_num_msg = 0
        self.local_endpoint: tuple[Any, int] = (0, 0)
        self.remote_endpoint: tuple[Any, int] = (0, 0)

    def fileno(self) -> int | None:
        """Return None. Derived classes return the file descriptor of the connection's socket."""
        return None

    def close(self) -> None:
        """Mark the transport as closed and pass it to the cleanup callback.

        Every call invokes the callback again.
        """
        self.done = True
        if self.cleanup_cb is not None:
            self.cleanup_cb(self)

    def set_cleanup_callback(self, cleanup_callback: Callable[[Any], object]) -> None:
        """Call the function when the connection closes."""
        self.cleanup_cb = cleanup_callback

    def write_data(self, data: bytes) -> None:
        """Send bytes. Overridden by derived classes.

        Raises:
            Exception: always, in this class.
        """
        raise Exception("not implemented")  # users of rospy catch this class

    def get_transport_info(self) -> str:
        """Return a description of the connection. Overridden by derived classes."""
        raise NotImplementedError


class DeadTransport(Transport):
    """Statistics kept after a connection has closed."""

    def __init__(self, transport: Transport) -> None:
        super().__init__(transport.direction, transport.name)
        self.transport_type = transport.transport_type
        self.id = transport.id
        self.endpoint_id = transport.endpoint_id
        self.stat_bytes = transport.stat_bytes
        self.stat_num_msg = transport.stat_num_msg
        self.done = True


class ProtocolHandler:
    """Base class for factories of connections that use one protocol."""

    def shutdown(self) -> None:
        """Do nothing. Derived classes override this method to stop the handler."""

    def create_transport(self, topic: str, pub_uri: str, protocol_params: list[Any]) -> Any:
        """Connect to a publisher. Overridden by derived classes."""
        raise Exception("interface impl")

    def supports(self, protocol: str) -> bool:
        """Return False. Derived classes return whether the protocol is supported."""
        del protocol
        return False

    def get_supported(self) -> list[list[str]]:
        """Return an empty list. Derived classes return the supported protocols with their parameters."""
        return []

    def init_publisher(self, topic: str, protocol: list[Any]) -> Any:
        """Answer a subscriber's topic request. Overridden by derived classes."""
        raise Exception("interface impl")


class InternalOfRospy:
    """Base class of stand-ins for genuine rospy's internal classes. Can be subclassed, but not instantiated.

    Raises:
        NotImplementedError: always.
    """

    def __init__(self, *args: object, **kwargs: object) -> None:
        del args, kwargs
        raise NotImplementedError(
            f"{type(self).__name__} is an internal class of genuine rospy that pipros does not have. "
            "Use rospy.Publisher, rospy.Subscriber, rospy.Service, rospy.ServiceProxy, or pipros.Node"
        )
