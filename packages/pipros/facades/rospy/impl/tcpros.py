"""`rospy.impl.tcpros`: starts the transport in genuine rospy. In pipros, the node opens its own ports."""

from __future__ import annotations

from pipros.basics.lazy_names import star_names as _star_names
from rospy.impl.tcpros_base import DEFAULT_BUFF_SIZE as DEFAULT_BUFF_SIZE
from rospy.impl.tcpros_base import init_tcpros_server as init_tcpros_server
from rospy.impl.tcpros_pubsub import TCPROSHandler as TCPROSHandler
from rospy.impl.tcpros_pubsub import get_tcpros_handler as get_tcpros_handler

_star_names(__name__, "rospy")


def init_tcpros(port: int = 0) -> None:
    """Do nothing: `init_node(tcpros_port=…)` opens the port."""
    del port
