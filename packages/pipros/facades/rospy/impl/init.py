"""`rospy.impl.init`: starts a node without `init_node`."""

from __future__ import annotations

from collections.abc import Mapping

from pipros.basics.env import Environment
from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.names import namespace
from pipros.node import Node
from rosgraph.rosenv import DEFAULT_MASTER_PORT as DEFAULT_MASTER_PORT
from rosgraph.rosenv import DEFAULT_MASTER_URI as DEFAULT_MASTER_URI
from rosgraph.roslogging import RosStreamHandler as RosStreamHandler
from rospy.core import is_shutdown as is_shutdown
from rospy.core import rospyerr as rospyerr
from rospy.core import signal_shutdown as signal_shutdown
from rospy.exceptions import ROSException
from rospy.impl.masterslave import ROSHandler as ROSHandler
from rospy.impl.tcpros import init_tcpros as init_tcpros
from rospy.session import session

_star_names(__name__, "logging os rosgraph sys time traceback")

DEFAULT_NODE_PORT = 0


def start_node(
    environ: Mapping[str, str],
    resolved_name: str,
    master_uri: str | None = None,
    port: int = 0,
    tcpros_port: int = 0,
) -> Node:
    """Start this process's node with a resolved name, but without logging, parameters or signal handlers.

    Returns:
        The node, which has `uri` and `name`.

    Raises:
        ROSException: the process already has a node.
    """
    if session.node is not None:
        raise ROSException(f"this process already has a node: [{session.node.name}]")
    environment = Environment.from_os(environ)
    environment = environment._replace(
        namespace=namespace(resolved_name),
        master_uri=master_uri or environment.master_uri,
    )
    base_name = resolved_name.rpartition("/")[2]
    node = Node(
        base_name, environment=environment, log=session.logger, rpc_port=port, tcpros_port=tcpros_port
    )
    node.start()
    session.node = node
    session.run_deferred(node)
    return node
