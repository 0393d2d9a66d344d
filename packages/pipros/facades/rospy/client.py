"""rospy's most common functions, for example to start the node and to access parameters."""

from __future__ import annotations

import errno
import functools
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ParamSpec, TypeVar

from pipros.basics.after_import import after_import as _after_import
from pipros.basics.env import Environment
from pipros.basics.errors import Interrupted, InvalidName, NotFound, Refused, Unreachable
from pipros.basics.interruptible_wait import OnceEvent
from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.names import is_legal_remapping, is_private, parse_arguments, text_of
from pipros.basics.shared_names import share_names
from pipros.msg import time as msg_time
from pipros.node.codec import AnyMessage
from pipros.node.missing_master import pytest_wait_s
from rospy.core import add_client_shutdown_hook, is_shutdown
from rospy.exceptions import ROSException, ROSInitException, ROSInterruptException
from rospy.logs import DEBUG as DEBUG
from rospy.logs import ERROR as ERROR
from rospy.logs import FATAL as FATAL
from rospy.logs import INFO as INFO
from rospy.logs import WARN as WARN
from rospy.logs import logdebug as logdebug
from rospy.logs import logerr as logerr
from rospy.logs import loginfo as loginfo
from rospy.logs import logwarn as logwarn
from rospy.msproxy import MasterProxy
from rospy.node_start import start_node
from rospy.rostime import in_seconds
from rospy.service import Service as Service
from rospy.session import session
from rospy.topics import Subscriber

_star_names(
    __name__,
    "roscpp.srv:GetLoggers roscpp.srv:GetLoggersResponse threading:Lock rosgraph_msgs.msg:Log "
    "roscpp.msg:Logger logging os random rosgraph roslib rospy roscpp.srv:SetLoggerLevel "
    "roscpp.srv:SetLoggerLevelResponse socket struct time yaml",
)

TIMEOUT_READY = 15.0


class _Unspecified:
    """Type of the placeholder for a default that was not given. Other packages import this class."""


_unspecified = _Unspecified()

P = ParamSpec("P")
T = TypeVar("T")


def _interruptible(function: Callable[P, T]) -> Callable[P, T]:
    """Wrap a function that calls the master, so that it raises the exceptions that users of rospy catch.

    These are `ROSInterruptException` if the node's shutdown interrupts the call, and
    `ConnectionRefusedError` if the master cannot be reached.
    """

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        try:
            return function(*args, **kwargs)
        except Interrupted:
            raise ROSInterruptException("rospy shutdown") from None
        except Unreachable as error:
            raise ConnectionRefusedError(errno.ECONNREFUSED, str(error)) from error

    return call


def init_node(
    name: str,
    argv: Sequence[str] | None = None,
    anonymous: bool = False,
    log_level: int | None = None,
    disable_rostime: bool = False,
    disable_rosout: bool = False,
    disable_signals: bool = False,
    xmlrpc_port: int = 0,
    tcpros_port: int = 0,
) -> None:
    """Make this process a ROS node, and wait until the master responds.

    Args:
        name: the node's name without a namespace; `__name:=` on the command line overrides it.
        argv: the command-line arguments with remappings; defaults to `sys.argv`.
        anonymous: whether to make the name unique.
        log_level: `rospy.DEBUG`, `INFO`, `WARN`, `ERROR` or `FATAL`; INFO by default, and if `disable_rosout`
            is true.
        disable_rostime: whether to use wall time even if `/use_sim_time` is set.
        disable_rosout: whether to disable publishing log messages.
        disable_signals: whether to leave SIGINT and SIGTERM to the caller.
        xmlrpc_port: the port of the node's slave API; 0 selects a free port.
        tcpros_port: the port for topics and services; 0 selects a free port. If neither port is given
            and `PIPROS_PORTS` is set, both use one free port from that range.

    Raises:
        ValueError: the name is empty or has a namespace, or a port is not a number.
        KeyError: there is no such `log_level`.
        ROSException: init_node was already called with different arguments.
        ROSInitException: a `_name:=value` is not YAML, or an argument contains two `:=`; or init_node was
            interrupted, or called outside the main thread with signals enabled.
    """
    start_node(
        session,
        name,
        argv,
        anonymous=anonymous,
        log_level=None if disable_rosout else log_level,  # as in Noetic
        disable_rostime=disable_rostime,
        disable_rosout=disable_rosout,
        disable_signals=disable_signals,
        rpc_port=int(xmlrpc_port),
        tcpros_port=int(tcpros_port),
    )
    _after_import("cv2", _show_windows)


def _show_windows(cv2: Any) -> None:
    """Let a plugin show OpenCV's windows. Only programs with OpenCV pay for a search of the plugins."""
    from pipros.basics.plugins import offered

    show = offered("windows")
    if show is not None and session.node is not None:
        show(cv2, session.node)


def spin() -> None:
    """Wait until the node is shut down. KeyboardInterrupt, which `disable_signals` permits, shuts it down.

    Raises:
        ROSInitException: init_node has not been called.
    """
    if session.node is None:
        raise ROSInitException("client code must call rospy.init_node() first")
    try:
        session.node.wait_for_shutdown()
    except KeyboardInterrupt:
        session.end("keyboard interrupt")


def on_shutdown(h: Callable[[], object]) -> None:
    """Call `h` when the node shuts down, while publishing still works.

    Raises:
        TypeError: `h` is not callable.
    """
    add_client_shutdown_hook(h)


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """Return the command line without remapping arguments."""
    return [item for item in (sys.argv if argv is None else argv) if not is_legal_remapping(item)]


def load_command_line_node_params(argv: Sequence[str]) -> dict[str, Any]:
    """Return the private parameters that a command line sets with `_name:=value`.

    Values are parsed as YAML.

    Raises:
        ROSInitException: a value is not YAML.
    """
    from pipros.safe import yaml

    try:
        return {name: yaml.load(text) for name, text in parse_arguments(argv).params.items()}
    except yaml.YamlError as error:
        raise ROSInitException(f"invalid command-line parameters: {error}") from None


@_interruptible
def get_published_topics(namespace: str = "/") -> list[list[str]]:
    """Return `[topic, type]` for every published topic in the namespace."""
    return session.master.get_published_topics(namespace or "")


def get_master(env: Mapping[str, str] | None = None) -> MasterProxy:
    """Return a proxy for direct calls to the master's API."""
    uri = session.master.uri if env is None else Environment.from_os(env).master_uri
    return MasterProxy(uri)


def wait_for_message(
    topic: str, topic_type: type[AnyMessage], timeout: float | msg_time.Duration | None = None
) -> AnyMessage:
    """Subscribe to a topic, and return the first message. Blocks.

    Raises:
        ROSException: no message arrived within `timeout` seconds; in pytest, without a timeout,
            also if `init_node` was not called and no message arrived within ten seconds.
        ROSInterruptException: the node was shut down while waiting.
    """
    arrived: list[AnyMessage] = []
    changed = OnceEvent()

    def keep_first(message: AnyMessage) -> None:
        arrived.append(message)
        changed.set()

    with session.hooks.ended_by_shutdown(changed):
        if is_shutdown():
            raise ROSInterruptException("rospy shutdown")
        subscriber = Subscriber(topic, topic_type, keep_first)
        try:
            changed.wait(_limit_s(timeout))
        finally:
            subscriber.unregister()
    if arrived:
        return arrived[0]
    if is_shutdown():
        raise ROSInterruptException("rospy shutdown")
    remedy = "" if session.node else ": rospy.init_node() was not called"
    raise ROSException(f"timeout exceeded while waiting for message on topic {topic}{remedy}")


def _limit_s(timeout: float | msg_time.Duration | None) -> float | None:
    if timeout is not None:
        return in_seconds(timeout)
    return pytest_wait_s() if session.node is None else None


@_interruptible
def get_param(param_name: str, default: Any = _unspecified) -> Any:
    """Return a parameter's value. A namespace is returned as a dictionary.

    Raises:
        KeyError: the parameter is not set, or its name is not a string, and no default was given.
    """
    try:
        return session.params.get(param_name)
    except (NotFound, InvalidName) as error:
        return _default(error, param_name, default)


@_interruptible
def get_param_cached(param_name: str, default: Any = _unspecified) -> Any:
    """Like `get_param`, but cache the value after `init_node`. The master notifies the node of changes."""
    try:
        return session.params.get_cached(param_name)
    except (NotFound, InvalidName) as error:
        return _default(error, param_name, default)


def _default(error: Exception, param_name: str, default: Any) -> Any:
    if default is _unspecified:
        raise _key_error(error, param_name) from None
    return default


def _key_error(error: Exception, param_name: str) -> KeyError:
    return KeyError(f"parameter: {error}" if isinstance(error, InvalidName) else param_name)


@_interruptible
def set_param(param_name: str, param_value: Any) -> None:
    """Set a parameter; a dictionary replaces a whole namespace.

    Setting the root, `/`, to anything but a dictionary has no effect.

    Raises:
        TypeError: the name is not a string, or XML-RPC cannot represent a value, such as None, a set, or a
            key that is not a string.
        OverflowError: an integer has more than 32 bits.
        ValueError: a name or a string contains a character that XML forbids.
        ROSException: the master rejected the request.
    """
    if session.resolve(param_name) == "/" and not isinstance(param_value, (dict, type(None))):
        return
    try:
        session.params.set(param_name, param_value)
    except Refused as error:
        raise ROSException(f"cannot set [{session.resolve(param_name)}]: {error.text}") from None


@_interruptible
def has_param(param_name: str) -> bool:
    """Return True if the parameter is set, or is a namespace that contains parameters."""
    try:
        return session.params.has(param_name)
    except InvalidName:
        return False


@_interruptible
def delete_param(param_name: str) -> None:
    """Delete a parameter or a namespace.

    Raises:
        KeyError: the parameter is not set.
    """
    try:
        session.params.delete(param_name)
    except (NotFound, InvalidName) as error:
        raise _key_error(error, param_name) from None


@_interruptible
def search_param(param_name: str) -> str | None:
    """Search for a parameter upwards from the node's namespace. Return its full name, or None.

    Raises:
        TypeError: the name is not a string.
        ROSException: the name is private.
    """
    if is_private(text_of(param_name)):
        raise ROSException(f"cannot search for parameter [{param_name}]: leave out the tilde")
    return session.params.search(param_name)


@_interruptible
def get_param_names() -> list[str]:
    """Return the names of all parameters."""
    return session.params.names()


share_names(__name__, session, {"_init_node_args": "init_arguments"})
