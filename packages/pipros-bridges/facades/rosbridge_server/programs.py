"""`rosrun rosbridge_server rosbridge_websocket`, `rosbridge_tcp` and `rosbridge_udp`: rosbridge servers.

Each server accepts the parameters that the package's launch files set. If the port is in use, the server
tries again after `~retry_startup_delay`. Once the port is open, its number is stored in `~actual_port`.
"""

from __future__ import annotations

import sys
import time
from typing import Any, Protocol

import rospy
from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_bridges.bridge_server import PING_S, PONG_S
from pipros_bridges.rosbridge.authentication import Authenticator
from pipros_bridges.rosbridge.encoding import bson_codec
from pipros_bridges.rosbridge.globs import Globs
from pipros_bridges.rosbridge.server import ServerOptions, WebSocketServer
from pipros_bridges.rosbridge.session import Timing
from pipros_bridges.rosbridge.settings import RosbridgeSettings
from pipros_bridges.rosbridge.stream_servers import TcpServer
from pipros_bridges.rosbridge.udp_server import UdpServer
from pipros_server.loop_share import switch_threads_often
from pipros_server.policy.policy_file import read_policy
from rospy.session import session


class Server(Protocol):
    """A server that can be started and closed."""

    def start(self) -> int: ...

    def close(self) -> None: ...


class WrongParameter(PiprosError):
    """A parameter or command-line option of a server has an invalid value."""


@exits_after_ctrl_c()
def websocket() -> int:
    """Run the WebSocket server until the node is shut down. Return the exit code."""
    rospy.init_node("rosbridge_websocket")
    return _serve(WebSocketServer, "Rosbridge WebSocket server started on port %d")


@exits_after_ctrl_c()
def tcp() -> int:
    """Run the TCP server until the node is shut down. Return the exit code."""
    rospy.init_node("rosbridge_tcp")
    return _serve(TcpServer, "Rosbridge TCP server started on port %d")


@exits_after_ctrl_c()
def udp() -> int:
    """Run the UDP server until the node is shut down. Return the exit code."""
    rospy.init_node("rosbridge_udp")
    return _serve(UdpServer, "Rosbridge UDP server started on port %d")


def _serve(server_class: Any, started: str) -> int:
    switch_threads_often()
    try:
        options = options_from_parameters(is_websocket=server_class is WebSocketServer)
        server: Server = server_class(session.node, options)
    except PiprosError as error:
        rospy.logfatal("%s", error)
        return 1
    delay_s = _number("retry_startup_delay", 5.0)
    while not rospy.is_shutdown():
        try:
            port = server.start()
        except OSError as error:
            rospy.logwarn(
                "cannot listen at %s:%d: %s. Trying again in %g s.",
                options.host,
                options.port,
                error,
                delay_s,
            )
            session.wait(max(delay_s, 0.1))
            continue
        rospy.set_param("~actual_port", port)
        rospy.loginfo(started, port)
        rospy.spin()
        server.close()
        break
    return 0


def options_from_parameters(*, is_websocket: bool) -> ServerOptions:
    """Return the options set by the node's parameters and command line.

    Raises:
        WrongParameter: a parameter or option has an invalid value.
        PiprosError: BSON is requested and pymongo is not installed, or the policy file is invalid.
    """
    arguments = _command_line()
    is_bson = bool(_parameter("bson_only_mode", False))
    if is_bson:
        bson_codec()
    ping_s = _number("websocket_ping_interval", PING_S)
    authenticator = _authenticator() if _parameter("authenticate", False) else None
    limit_bytes = _number("max_message_size", 0.0)
    certificate = _parameter("certfile", None)
    policy = arguments.get("policy") or _parameter("policy", None)
    return ServerOptions(
        host=str(arguments.get("address") or _parameter("address", "127.0.0.1")),
        port=int(arguments.get("port") or _number("port", 9090)),
        certificate=str(certificate) if certificate else None,
        key=str(_parameter("keyfile", None) or certificate) if certificate else None,
        allows_null_origin=bool(_parameter("websocket_null_origin", False)),
        authenticator=authenticator if is_websocket else None,
        ping_s=ping_s or None,
        pong_s=_number("websocket_ping_timeout", PONG_S) or None,
        message_bytes=int(limit_bytes) or None,
        settings=RosbridgeSettings(
            topics=Globs.parse(_parameter("topics_glob", "")),
            services=Globs.parse(_parameter("services_glob", "")),
            authenticator=None if is_websocket else authenticator,
            is_bson=is_bson,
            fragment_timeout_s=_number("fragment_timeout", 600.0),
            policy=read_policy(policy) if policy else None,
        ),
        timing=Timing(unregister_s=_number("unregister_timeout", 10.0)),
    )


def _command_line() -> dict[str, str]:
    """Return the values of the options `--port`, `--address` and `--policy`, if given, by option name."""
    words = rospy.myargv(sys.argv)[1:]
    found = {}
    for name in ("port", "address", "policy"):
        if f"--{name}" in words:
            index = words.index(f"--{name}") + 1
            if index == len(words) or (name == "port" and not words[index].isdigit()):
                raise WrongParameter(f"--{name} needs {'a number' if name == 'port' else 'a value'}")
            found[name] = words[index]
    return found


def _parameter(name: str, default: Any) -> Any:
    """Return a private parameter, or the default if the parameter is unset, empty or "None"."""
    value = rospy.get_param(f"~{name}", default)
    return default if value in ("None", "") else value


def _number(name: str, default: float) -> float:
    value = _parameter(name, default)
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = -1.0
    if number < 0:
        raise WrongParameter(f"~{name} must be a number >= 0, got {value}")
    return number


def _authenticator() -> Authenticator:
    file = _parameter("secret_file", None)
    if not file:
        raise WrongParameter("~authenticate requires ~secret_file, a file with a 16-character secret")
    try:
        return Authenticator(read_text(str(file)).strip(), time.time)
    except (OSError, ValueError) as error:
        raise WrongParameter(f"~secret_file {file}: {error}") from None
