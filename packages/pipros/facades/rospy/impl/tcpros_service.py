"""`rospy.impl.tcpros_service`: services, and names from genuine rospy's service transport."""

from __future__ import annotations

import logging

from pipros.basics.lazy_names import star_names as _star_names
from rospy.core import isstring as isstring
from rospy.core import logdebug as logdebug
from rospy.core import logerr as logerr
from rospy.core import loginfo as loginfo
from rospy.core import logwarn as logwarn
from rospy.exceptions import ROSException as ROSException
from rospy.exceptions import ROSInterruptException as ROSInterruptException
from rospy.exceptions import TransportInitError as TransportInitError
from rospy.exceptions import TransportTerminated as TransportTerminated
from rospy.impl.registration import get_service_manager as get_service_manager
from rospy.impl.tcpros_base import DEFAULT_BUFF_SIZE as DEFAULT_BUFF_SIZE
from rospy.impl.tcpros_base import TCPROSTransport as TCPROSTransport
from rospy.impl.tcpros_base import TCPROSTransportProtocol as TCPROSTransportProtocol
from rospy.impl.tcpros_base import get_tcpros_server_address as get_tcpros_server_address
from rospy.impl.tcpros_base import recv_buff as recv_buff
from rospy.impl.tcpros_base import start_tcpros_server as start_tcpros_server
from rospy.service import Service as Service
from rospy.service import ServiceException as ServiceException
from rospy.service import ServiceProxy as ServiceProxy
from rospy.service import convert_return_to_response as convert_return_to_response
from rospy.service import wait_for_service as wait_for_service

_star_names(__name__, "genpy io rosgraph rospy socket struct sys threading time traceback")

logger = logging.getLogger("rospy.service")

ServiceImpl = Service


class TCPService(TCPROSTransportProtocol):
    """The server side of a service in genuine rospy."""


class TCPROSServiceClient(TCPROSTransportProtocol):
    """The client side of a service in genuine rospy."""


def service_connection_handler(sock: object, client_addr: object, header: object) -> str:
    """Raise NotImplementedError, because pipros's node accepts callers' connections itself."""
    del sock, header
    raise NotImplementedError(f"use rospy.Service instead of accepting the connection from {client_addr}")
