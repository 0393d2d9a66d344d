"""Life of the node, and names that older code imports from here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pipros.wire.uri import split_uri
from rospy.exceptions import ParameterInvalid as ParameterInvalid
from rospy.logs import logdebug as logdebug
from rospy.logs import logdebug_once as logdebug_once
from rospy.logs import logdebug_throttle as logdebug_throttle
from rospy.logs import logdebug_throttle_identical as logdebug_throttle_identical
from rospy.logs import logerr as logerr
from rospy.logs import logerr_once as logerr_once
from rospy.logs import logerr_throttle as logerr_throttle
from rospy.logs import logerr_throttle_identical as logerr_throttle_identical
from rospy.logs import logerror as logerror
from rospy.logs import logfatal as logfatal
from rospy.logs import logfatal_once as logfatal_once
from rospy.logs import logfatal_throttle as logfatal_throttle
from rospy.logs import logfatal_throttle_identical as logfatal_throttle_identical
from rospy.logs import loginfo as loginfo
from rospy.logs import loginfo_once as loginfo_once
from rospy.logs import loginfo_throttle as loginfo_throttle
from rospy.logs import loginfo_throttle_identical as loginfo_throttle_identical
from rospy.logs import logout as logout
from rospy.logs import logwarn as logwarn
from rospy.logs import logwarn_once as logwarn_once
from rospy.logs import logwarn_throttle as logwarn_throttle
from rospy.logs import logwarn_throttle_identical as logwarn_throttle_identical
from rospy.names import get_caller_id as get_caller_id
from rospy.names import get_name as get_name
from rospy.names import get_namespace as get_namespace
from rospy.names import remap_name as remap_name
from rospy.names import resolve_name as resolve_name
from rospy.session import session

ROSRPC = "rosrpc://"


def is_initialized() -> bool:
    """True once init_node has returned."""
    return session.is_initialized


def is_shutdown() -> bool:
    """True from the moment the node began to shut down; its shutdown hooks still see False."""
    return session.is_shutdown


def is_shutdown_requested() -> bool:
    """True as soon as the node has been told to shut down, also inside shutdown hooks."""
    return session.is_shutdown or (session.node is not None and session.node.is_ending)


def signal_shutdown(reason: str) -> None:
    """Shuts the node down: hooks first, then its entries at the master, then its links.

    Returns when it is done. Harmless when repeated.
    """
    session.end(reason)


def check_hook(hook: object) -> None:
    """Raises TypeError for what cannot be called."""
    if not callable(hook):
        raise TypeError(f"shutdown hook [{hook}] must be a function or callable object: {type(hook)}")


def add_client_shutdown_hook(hook: Callable[[], object]) -> None:
    """Has `hook` called when the node shuts down, while publishing still works.

    Raises:
        TypeError: it cannot be called.
    """
    check_hook(hook)
    session.add_client_hook(hook)


def add_preshutdown_hook(hook: Callable[[str], object]) -> None:
    """Has `hook` called with the reason after the client's hooks; raises as `add_client_shutdown_hook`."""
    check_hook(hook)
    session.add_preshutdown_hook(hook)


def add_shutdown_hook(hook: Callable[[str], object]) -> None:
    """Has `hook` called with the reason once the node has left the graph; raises as the others."""
    check_hook(hook)
    session.add_shutdown_hook(hook)


def get_node_uri() -> str | None:
    """The URI of the node's slave API; None before init_node."""
    return session.node.uri if session.node is not None else None


def get_ros_root(required: bool = False, env: dict[str, str] | None = None) -> str | None:
    """`ROS_ROOT`, which ROS 1 has not needed for long."""
    import os

    from rospy.exceptions import ROSException

    root = (os.environ if env is None else env).get("ROS_ROOT")
    if required and root is None:
        raise ROSException("The ROS_ROOT environment variable has not been set")
    return root


def parse_rosrpc_uri(uri: str) -> tuple[str, int]:
    """Host and port of a service's URI.

    Raises:
        ParameterInvalid: it is not `rosrpc://host:port`.
    """
    try:
        host, port, _ = split_uri(uri, ["rosrpc"])
    except ValueError:
        host, port = "", 0
    if not uri.startswith(ROSRPC) or not port:
        raise ParameterInvalid(f"ERROR: invalid rosrpc address: {uri}")
    return host, port


def xmlrpcapi(uri: str | None, cache: bool = True) -> object | None:
    """An XML-RPC proxy of a node or master; None when `uri` has no host."""
    del cache  # connections are the proxy's own affair
    from urllib.parse import urlsplit  # takes what has no port as well, as `ServerProxy` does

    if uri is None or not urlsplit(uri).netloc:
        return None
    from xmlrpc.client import ServerProxy

    return ServerProxy(uri)


def __getattr__(name: str) -> Any:
    """The state of the node as some packages look at it."""
    if name == "_in_shutdown":
        return session.is_shutdown
    raise AttributeError(f"module 'rospy.core' has no attribute '{name}'")
