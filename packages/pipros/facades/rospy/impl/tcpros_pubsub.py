"""`rospy.impl.tcpros_pubsub`: names from genuine rospy's topic transport, which pipros replaces."""

from __future__ import annotations

from pipros.basics.errors import PiprosError
from pipros.basics.lazy_names import star_names as _star_names
from pipros_tools.graph.system_state import SystemState
from rospy.core import logdebug as logdebug
from rospy.core import logerr as logerr
from rospy.core import logwarn as logwarn
from rospy.core import rospyerr as rospyerr
from rospy.impl.tcpros_base import DEFAULT_BUFF_SIZE as DEFAULT_BUFF_SIZE
from rospy.impl.tcpros_base import TCPROS as TCPROS
from rospy.impl.tcpros_base import TCPROSTransport as TCPROSTransport
from rospy.impl.tcpros_base import TCPROSTransportProtocol as TCPROSTransportProtocol
from rospy.impl.tcpros_base import get_tcpros_server_address as get_tcpros_server_address
from rospy.impl.tcpros_base import start_tcpros_server as start_tcpros_server
from rospy.impl.transport import InternalOfRospy, ProtocolHandler
from rospy.session import session

_star_names(__name__, "rospy xmlrpc.client:ServerProxy socket threading time")


class TCPROSPub(TCPROSTransportProtocol):
    """The publishing side of a topic in genuine rospy."""


class TCPROSSub(TCPROSTransportProtocol):
    """The receiving side of a topic in genuine rospy."""


class QueuedConnection(InternalOfRospy):
    """Genuine rospy's connection with its own queue and thread."""


class TCPROSHandler(InternalOfRospy, ProtocolHandler):
    """Factory for topic connections in genuine rospy."""


def get_tcpros_handler() -> None:
    """Return None: pipros's node opens its connections itself."""


def robust_connect_subscriber(
    conn: object,
    dest_addr: str,
    dest_port: int,
    pub_uri: str,
    receive_cb: object,
    resolved_topic_name: str,
) -> None:
    """Raise NotImplementedError, because pipros's node connects to publishers itself."""
    del conn, receive_cb
    publisher = f"{dest_addr}:{dest_port} ({pub_uri})"
    raise NotImplementedError(
        f"use rospy.Subscriber to receive [{resolved_topic_name}] instead of connecting to {publisher}"
    )


def check_if_still_publisher(resolved_topic_name: str, pub_uri: str) -> bool:
    """Return whether the master lists the node at `pub_uri` as a publisher.

    Return False if the master does not respond.
    """
    try:
        state = SystemState.from_state(session.master.get_system_state())
        nodes = state.publishers.get(resolved_topic_name, [])
        return any(session.master.lookup_node(node) == pub_uri for node in nodes)
    except PiprosError:
        return False
