"""Life cycle of the node, and names that older code imports from here."""

from __future__ import annotations

import functools
import logging
import threading
import warnings
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from pipros.basics import one_thread
from pipros.basics.shared_names import share_names
from pipros.basics.uri import split_uri
from pipros.net.argument_checks import below_root
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
from rospy.names import *  # noqa: F403  # imported from here by other code
from rospy.names import ParameterInvalid, ROSException, ROSInitException
from rospy.session import session
from rospy.shutdown_hooks import THREAD_END_S

is_topic = below_root

_TIMEOUT_SHUTDOWN_JOIN = THREAD_END_S
ROSRPC = "rosrpc://"
MASTER_NAME = "master"

P = ParamSpec("P")
T = TypeVar("T")

_rospy_logger = logging.getLogger("rospy.internal")

# Log messages of the client library itself. They are written to log files but not to `/rosout`.
rospydebug = _rospy_logger.debug
rospyinfo = _rospy_logger.info
rospywarn = _rospy_logger.warning
rospyerr = _rospy_logger.error


def deprecated(func: Callable[P, T]) -> Callable[P, T]:
    """Wrap a function so that each call issues a DeprecationWarning."""

    @functools.wraps(func)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        warnings.warn(
            f"Call to deprecated function {func.__name__}.", category=DeprecationWarning, stacklevel=2
        )
        return func(*args, **kwargs)

    return call


def is_initialized() -> bool:
    """Return True once init_node has returned."""
    return session.globals.is_initialized


def set_initialized(initialized: bool) -> None:
    """Set the result of `is_initialized`. Ordinary programs call `init_node`, which does this."""
    session.globals.is_initialized = initialized


def is_shutdown() -> bool:
    """Return True once the node has started to shut down.

    The client and preshutdown hooks can still publish, so the result is still False in these hooks.
    """
    one_thread.take_turn()  # loops that never sleep wait for callbacks, too
    return session.is_shutdown


def is_shutdown_requested() -> bool:
    """Return True once shutdown has been requested, including inside shutdown hooks."""
    return session.globals.is_ending


def signal_shutdown(reason: str) -> None:
    """Shut the node down: run the hooks, unregister from the master, then close all connections.

    Blocks until the shutdown is complete. May be called repeatedly.
    """
    session.end(reason)


def check_hook(hook: object) -> None:
    """Raise TypeError if the hook is not callable."""
    if not callable(hook):
        raise TypeError(f"shutdown hook [{hook}] must be a function or callable object: {type(hook)}")


def add_client_shutdown_hook(h: Callable[[], object]) -> None:
    """Call `h` when the node shuts down, while publishing still works.

    After the shutdown, call `h` immediately.

    Raises:
        TypeError: `h` is not callable.
    """
    check_hook(h)
    session.call_or_add(session.hooks.client, h)


def add_preshutdown_hook(h: Callable[[str], object]) -> None:
    """Call `h` with the shutdown reason, after the client hooks.

    Raises the same errors as `add_client_shutdown_hook`.
    """
    check_hook(h)
    session.call_or_add(session.hooks.preshutdown, h, "already shutdown")


def add_shutdown_hook(h: Callable[[str], object]) -> None:
    """Call `h` with the shutdown reason, once the node has unregistered.

    Raises the same errors as `add_client_shutdown_hook`.
    """
    check_hook(h)
    session.call_or_add(session.hooks.shutdown, h, "already shutdown")


def register_signals() -> None:
    """Make SIGINT and SIGTERM shut the node down, as `init_node` does by default.

    Raises:
        ROSInitException: called outside the main thread.
    """
    session.install_signals()


def configure_logging(node_name: str, level: int = logging.INFO) -> None:
    """Open a node's log file, as `init_node` does; see `rosgraph.roslogging.configure_logging`.

    Raises:
        ROSInitException: the name is empty.
    """
    from rosgraph import roslogging

    name = node_name.strip("/").replace("/", "_")
    if not name:
        raise ROSInitException(f"node name [{node_name}] is empty")
    session.globals.log_file = roslogging.configure_logging("rospy", level, filename=f"{name}.log")


def get_node_uri() -> str | None:
    """Return the URI of the node's slave API, or None before `init_node`."""
    return session.globals.node_uri


def set_node_uri(uri: str) -> None:
    """Set the result of `get_node_uri`."""
    session.globals.node_uri = uri


def get_ros_root(required: bool = False, env: dict[str, str] | None = None) -> str | None:
    """Return the environment variable `ROS_ROOT`, or None. ROS 1 no longer needs the variable.

    Raises:
        ROSException: the variable is `required` but not set.
    """
    import os

    root = (os.environ if env is None else env).get("ROS_ROOT")
    if required and root is None:
        raise ROSException("The ROS_ROOT environment variable has not been set")
    return root


def parse_rosrpc_uri(uri: str) -> tuple[str, int]:
    """Return the host and port of a service URI.

    Raises:
        ParameterInvalid: the URI is not `rosrpc://host:port`.
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
    """Return an XML-RPC proxy for a node or master, or None if `uri` does not contain a host."""
    del cache  # the proxy manages its connections itself
    from urllib.parse import urlsplit  # like `server_proxy`, accepts a URI without a port

    if uri is None or not urlsplit(uri).netloc:
        return None
    from pipros.net.server_proxy import server_proxy

    return server_proxy(uri)


class NullHandler(logging.NullHandler):
    """Handler that discards log records."""

    def emit(self, record: object) -> None:
        """Do nothing."""


def _add_shutdown_thread(t: threading.Thread) -> None:
    """Make the node's shutdown wait for a running thread, for a few seconds at most."""
    if not session.is_shutdown:
        session.hooks.join(t)


share_names(
    __name__,
    session,
    {
        "_client_ready": "globals.is_initialized",
        "_client_shutdown_hooks": "hooks.client",
        "_in_shutdown": "globals.is_ending",
        "_log_filename": "globals.log_file",
        "_preshutdown_hooks": "hooks.preshutdown",
        "_shutdown_flag": "globals.is_shutdown",
        "_shutdown_hooks": "hooks.shutdown",
        "_shutdown_threads": "hooks.threads",
        "_uri": "globals.node_uri",
    },
)
