"""`rospy.impl.tcpros_base`: names from genuine rospy's transport, which pipros replaces with `pipros.net`."""

from __future__ import annotations

import io
import logging
import socket
from errno import EAGAIN as EAGAIN
from errno import EWOULDBLOCK as EWOULDBLOCK
from typing import TYPE_CHECKING, Any

from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.uri import split_uri
from pipros.msg.base import Message as Message
from pipros.msg.errors import DeserializationError as DeserializationError
from rospy.core import *  # noqa: F403  # imported from here by other code
from rospy.exceptions import ROSInternalException as ROSInternalException
from rospy.exceptions import TransportException as TransportException
from rospy.exceptions import TransportInitError as TransportInitError
from rospy.exceptions import TransportTerminated as TransportTerminated
from rospy.impl.transport import BIDIRECTIONAL as BIDIRECTIONAL
from rospy.impl.transport import InternalOfRospy
from rospy.impl.transport import Transport as Transport
from rospy.msg import deserialize_messages as deserialize_messages
from rospy.msg import serialize_message as serialize_message
from rospy.service import ServiceException as ServiceException
from rospy.session import session
from rospy.topics import DEFAULT_BUFF_SIZE as DEFAULT_BUFF_SIZE

if TYPE_CHECKING:
    from collections.abc import Mapping

_star_names(
    __name__,
    "atexit io:BytesIO errno inspect rosgraph_msgs.msg:Log hashlib:md5 os functools:partial pickle rosgraph "
    "rospkg rospy select signal io:StringIO struct sys time traceback types urlparse=urllib.parse "
    "xmlrpcclient=xmlrpc.client",
)

TCPROS = "TCPROS"
python3 = 1

logger = logging.getLogger("rospy.tcpros")


class TCPServer(InternalOfRospy):
    """Server that accepts connections in genuine rospy."""


class TCPROSServer(InternalOfRospy):
    """Server that accepts topic and service connections in genuine rospy."""


class TCPROSTransportProtocol(InternalOfRospy):
    """Base class of genuine rospy's protocols for one topic or service."""


class TCPROSTransport(InternalOfRospy, Transport):
    """One connection in genuine rospy."""


def recv_buff(sock: socket.socket, b: io.BytesIO, buff_size: int) -> int:
    """Append at most `buff_size` received bytes to a buffer, and return the number of bytes received.

    Raises:
        TransportTerminated: the other side has closed the connection.
    """
    data = sock.recv(buff_size)
    if not data:
        raise TransportTerminated("unable to receive data from sender, check sender's logs for details")
    return b.write(data)


def read_ros_handshake_header(sock: socket.socket, b: io.BytesIO, buff_size: int) -> dict[str, str]:
    """Read a connection header; see `rosgraph.network`.

    Raises:
        ROSHandshakeException: the header is malformed, or the connection was closed before it was complete.
    """
    # imported on first use: it loads the rest of rosgraph, which few programs need
    from rosgraph import network

    return network.read_ros_handshake_header(sock, b, buff_size)


def write_ros_handshake_header(sock: socket.socket, header: Mapping[str, Any]) -> int:
    """Send a connection header, and return its length; see `rosgraph.network`."""
    from rosgraph import network

    return network.write_ros_handshake_header(sock, header)


def get_tcpros_server_address() -> tuple[str, int] | None:
    """Return the host and port at which the node accepts connections, or None before `init_node`."""
    if session.node is None:
        return None
    host, port, _ = split_uri(session.node.endpoints.service_uri, ["rosrpc"])
    return host, port


def init_tcpros_server(port: int = 0) -> None:
    """Do nothing: `init_node(tcpros_port=…)` opens the port."""
    del port


def start_tcpros_server() -> tuple[str, int] | None:
    """Return `get_tcpros_server_address()`. `init_node` has already started the server."""
    return get_tcpros_server_address()
