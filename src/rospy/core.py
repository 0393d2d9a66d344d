"""Life of the node, and names that older code imports from here."""

from __future__ import annotations

import functools
import logging
import threading
import warnings
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from pipros.net.argument_checks import below_root
from pipros.shared_names import share_names
from pipros.wire.uri import split_uri
from rospy.logs import LoggingIdentical as LoggingIdentical
from rospy.logs import LoggingOnce as LoggingOnce
from rospy.logs import LoggingThrottle as LoggingThrottle
from rospy.logs import _logging_identical as _logging_identical
from rospy.logs import _logging_once as _logging_once
from rospy.logs import _logging_throttle as _logging_throttle
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
from rospy.names import *  # noqa: F403  # what others import from here
from rospy.names import ParameterInvalid, ROSException, ROSInitException
from rospy.session import THREAD_END_S, session

is_topic = below_root

_TIMEOUT_SHUTDOWN_JOIN = THREAD_END_S
ROSRPC = "rosrpc://"
MASTER_NAME = "master"

P = ParamSpec("P")
T = TypeVar("T")

_rospy_logger = logging.getLogger("rospy.internal")

# What the client library itself says: for log files, not for `/rosout`.
rospydebug = _rospy_logger.debug
rospyinfo = _rospy_logger.info
rospywarn = _rospy_logger.warning
rospyerr = _rospy_logger.error


def deprecated(func: Callable[P, T]) -> Callable[P, T]:
    """Has each call of the function warn that it is deprecated."""

    @functools.wraps(func)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        warnings.warn(
            f"Call to deprecated function {func.__name__}.", category=DeprecationWarning, stacklevel=2
        )
        return func(*args, **kwargs)

    return call


def is_initialized() -> bool:
    """True once init_node has returned."""
    return session.is_initialized


def set_initialized(initialized: bool) -> None:
    """Has `is_initialized` answer that from now on. `init_node` sees to it for others."""
    session.is_initialized = initialized


def is_shutdown() -> bool:
    """True from the moment the node began to shut down; its shutdown hooks still see False."""
    return session.is_shutdown


def is_shutdown_requested() -> bool:
    """True as soon as the node has been told to shut down, also inside shutdown hooks."""
    return session.is_ending


def signal_shutdown(reason: str) -> None:
    """Shuts the node down: hooks first, then its entries at the master, then its links.

    Returns when it is done. May be repeated.
    """
    session.end(reason)


def check_hook(hook: object) -> None:
    """Raises TypeError for what cannot be called."""
    if not callable(hook):
        raise TypeError(f"shutdown hook [{hook}] must be a function or callable object: {type(hook)}")


def add_client_shutdown_hook(h: Callable[[], object]) -> None:
    """Has `h` called when the node shuts down, while publishing still works; at once if it has already.

    Raises:
        TypeError: it cannot be called.
    """
    check_hook(h)
    session.add_client_hook(h)


def add_preshutdown_hook(h: Callable[[str], object]) -> None:
    """Has `h` called with the reason after the client's hooks; raises as `add_client_shutdown_hook`."""
    check_hook(h)
    session.add_preshutdown_hook(h)


def add_shutdown_hook(h: Callable[[str], object]) -> None:
    """Has `h` called with the reason once the node has left the graph; raises as the others."""
    check_hook(h)
    session.add_shutdown_hook(h)


def register_signals() -> None:
    """Has SIGINT and SIGTERM end the node, as `init_node` does unless told not to.

    Raises:
        ROSInitException: not in the main thread.
    """
    session.install_signals()


def configure_logging(node_name: str, level: int = logging.INFO) -> None:
    """Opens the log file of a node, as `init_node` does; see `rosgraph.roslogging.configure_logging`.

    Raises:
        ROSInitException: the name is empty, or not a base name.
    """
    from rosgraph import roslogging

    name = node_name.strip("/").replace("/", "_")
    if not name:
        raise ROSInitException(f"node name [{node_name}] is empty")
    session.log_file = roslogging.configure_logging("rospy", level, filename=f"{name}.log")


def get_node_uri() -> str | None:
    """The URI of the node's slave API; None before init_node."""
    return session.node_uri


def set_node_uri(uri: str) -> None:
    """Has `get_node_uri` answer that from now on."""
    session.node_uri = uri


def get_ros_root(required: bool = False, env: dict[str, str] | None = None) -> str | None:
    """`ROS_ROOT`, which ROS 1 has not needed for long."""
    import os

    root = (os.environ if env is None else env).get("ROS_ROOT")
    if required and root is None:
        raise ROSException("The ROS_ROOT environment variable has not been set")
    return root


def parse_rosrpc_uri(uri: str) -> tuple[str, int]:
    """Host and port of a service's URI.

    Raises:
        ParameterInvalid: it is not `rosrpc://host:port`.
    """
    if not uri.startswith(ROSRPC):
        raise ParameterInvalid(f"Invalid protocol for ROS service URL: {uri}")
    try:
        host, port, _ = split_uri(uri, ["rosrpc"])
    except ValueError:
        host, port = "", 0
    if not port:
        raise ParameterInvalid(f"ROS service URL is invalid: {uri}")
    return host, port


def xmlrpcapi(uri: str | None, cache: bool = True) -> object | None:
    """An XML-RPC proxy of a node or master; None when `uri` has no host."""
    del cache  # connections are the proxy's own affair
    from urllib.parse import urlsplit  # takes what has no port as well, as `ServerProxy` does

    if uri is None or not urlsplit(uri).netloc:
        return None
    from xmlrpc.client import ServerProxy

    return ServerProxy(uri)


class NullHandler(logging.NullHandler):
    """Takes what is logged, and does nothing with it."""

    def emit(self, record: object) -> None:
        """Does nothing."""


def _add_shutdown_thread(t: threading.Thread) -> None:
    """Has the end of the node wait for a thread that runs, for some seconds at most."""
    session.join_at_the_end(t)


share_names(
    __name__,
    session,
    {
        "_client_ready": "is_initialized",
        "_client_shutdown_hooks": "client_hooks",
        "_in_shutdown": "is_ending",
        "_log_filename": "log_file",
        "_preshutdown_hooks": "preshutdown_hooks",
        "_shutdown_flag": "is_shutdown",
        "_shutdown_hooks": "shutdown_hooks",
        "_shutdown_threads": "threads_to_join",
        "_uri": "node_uri",
    },
)
