"""Classes for the parts of a launch, with Noetic's names.

Their instances are mutable, and can be converted to and from `pipros_tools.launch.model`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from enum import Enum
from typing import Any
from xmlrpc.client import MultiCall, ServerProxy

from pipros.basics import names
from pipros.basics.env import Environment, split_master_uri
from pipros_tools.launch import model, run_id
from pipros_tools.launch.model import LaunchError
from rosgraph.network import create_local_xmlrpc_uri, parse_http_host_and_port
from roslaunch.machines import Machine, is_machine_local, local_machine
from roslaunch.printing import (
    add_printerrlog_handler,
    add_printlog_handler,
    clear_printerrlog_handlers,
    clear_printlog_handlers,
    printerrlog,
    printlog,
    printlog_bold,
)

__all__ = [
    "PHASE_RUN",
    "PHASE_SETUP",
    "PHASE_TEARDOWN",
    "TEST_TIME_LIMIT_DEFAULT",
    "Executable",
    "Machine",
    "Master",
    "Node",
    "Param",
    "RLException",
    "RosbinExecutable",
    "Test",
    "add_printerrlog_handler",
    "add_printlog_handler",
    "clear_printerrlog_handlers",
    "clear_printlog_handlers",
    "generate_run_id",
    "get_master_uri_env",
    "is_machine_local",
    "local_machine",
    "printerrlog",
    "printlog",
    "printlog_bold",
    "remap_localhost_uri",
    "setup_env",
]

FileAndArguments = str | tuple[str, Sequence[str]]
"""A launch file, optionally with its `name:=value` arguments."""

RLException = LaunchError
"""Base class of all roslaunch errors."""

PHASE_SETUP = "setup"
PHASE_RUN = "run"
PHASE_TEARDOWN = "teardown"
TEST_TIME_LIMIT_DEFAULT = 60

_IS_RUNNING_TIMEOUT_S = 5.0


class Master:
    """A master with its URI, which defaults to `ROS_MASTER_URI`."""

    __slots__ = ("auto", "type", "uri")

    ROSMASTER = "rosmaster"
    ZENMASTER = "zenmaster"

    def __init__(self, type_: str | None = None, uri: str | None = None, auto: object = None) -> None:
        _ = auto
        self.auto = None
        self.type = type_ or Master.ROSMASTER
        self.uri: str = uri or get_master_uri_env()

    def get_host(self) -> str:
        """Return the host of the URI."""
        return parse_http_host_and_port(self.uri)[0]

    def get_port(self) -> int:
        """Return the port of the URI."""
        return parse_http_host_and_port(self.uri)[1]

    def get(self) -> ServerProxy:
        """Return an XML-RPC proxy for the master."""
        from pipros.net.server_proxy import server_proxy

        return server_proxy(self.uri)

    def get_multi(self) -> MultiCall:
        """Return an XML-RPC proxy that combines several calls in one request."""
        return MultiCall(self.get())

    def is_running(self) -> bool:
        """Return whether the master responds. Blocks for up to five seconds."""
        from pipros.basics.errors import PiprosError
        from pipros.net.master_client import MasterClient

        client = MasterClient(self.uri, "/roslaunch", timeout_s=_IS_RUNNING_TIMEOUT_S)
        try:
            client.get_pid()
        except (PiprosError, ValueError):
            return False
        finally:
            client.close()
        return True

    def __eq__(self, m2: object) -> bool:
        return isinstance(m2, Master) and (m2.type, m2.uri) == (self.type, self.uri)

    __hash__ = None  # type: ignore[assignment]  # its attributes change


class Param:
    """A parameter with its full name."""

    def __init__(self, key: str, value: Any) -> None:
        self.key = names.canonicalize(key)
        self.value = value

    def __eq__(self, p: object) -> bool:
        return isinstance(p, Param) and (p.key, p.value) == (self.key, self.value)

    __hash__ = None  # type: ignore[assignment]  # its value changes

    def __str__(self) -> str:
        return f"{self.key}={self.value}"

    __repr__ = __str__


class Node:
    """A node to launch: `Node("rospy_tutorials", "talker.py", name="talker")`.

    Attributes:
        process_name: the name of the node's process, available after the launch.
        machine: the machine that the node runs on, available after `assign_machines`.
    """

    __slots__ = (
        *(each.library for each in model.NODE_SETTINGS if each.library),
        "_rest",
        "filename",
        "machine",
        "process_name",
    )

    def __init__(
        self,
        package: str,
        node_type: str,
        name: str | None = None,
        namespace: str = "/",
        machine_name: str | None = None,
        args: str = "",
        respawn: bool = False,
        respawn_delay: float = 0.0,
        remap_args: Iterable[Sequence[str]] | None = None,
        env_args: Iterable[Sequence[str]] | None = None,
        output: str | None = None,
        cwd: str | None = None,
        launch_prefix: str | None = None,
        required: bool = False,
        filename: str = "<unknown>",
    ) -> None:
        self.package = package
        self.type = node_type
        self.name, self.machine_name, self.launch_prefix = (
            text or None for text in (name, machine_name, launch_prefix)
        )
        self.namespace = re.sub("//+", "/", names.make_global_namespace(namespace or "/"))
        self.respawn = respawn
        self.respawn_delay = respawn_delay
        self.args = args or ""
        self.remap_args: Any = remap_args or []
        self.env_args: Any = env_args or []
        self.output = output
        self.cwd = {"ros_home": "ROS_HOME"}.get(cwd or "", cwd)
        self.required = required
        self.filename = filename
        self.process_name: str | None = None
        self.machine: Machine | None = None
        self._rest: dict[str, Any] = {}
        self._check()

    def _check(self) -> None:
        """Raise ValueError if an attribute is invalid."""
        for is_broken, rule in (
            (self.respawn and self.required, "respawn and required cannot both be set to true"),
            ("/" in (self.name or ""), "node name cannot contain a namespace"),
            (not self.package.strip(), "package must be non-empty"),
            (not self.type.strip(), "type must be non-empty"),
            (self.output not in ("log", "screen", None), "output must be one of 'log', 'screen'"),
            (self.cwd not in ("ROS_HOME", "node", None), "cwd must be one of 'ROS_HOME', 'node'"),
        ):
            if is_broken:
                raise ValueError(rule)

    def to_model(self) -> model.LaunchNode:
        """Return the corresponding pipros object. A node without a name gets an anonymous name."""
        name = self.name or names.anonymous(self.type.replace(".", "_"))
        found: dict[str, Any] = {**self._rest, "name": name}
        for each in model.NODE_SETTINGS:
            if each.field not in found and (value := getattr(self, each.library, None)):
                if isinstance(each.default, tuple):
                    value = tuple((str(key), str(word)) for key, word in value)
                found[each.field] = each.choices(value) if each.choices else value
        return model.LaunchNode(**found)

    @classmethod
    def from_model(cls, node: model.LaunchNode) -> Node:
        """Create a Node from the corresponding pipros object."""
        made = Node(node.package, node.type)
        made._take(node)
        return made

    def _take(self, node: model.LaunchNode) -> None:
        """Set all attributes that are not empty in `node`. `_rest` has those that Noetic does not know."""
        for each in model.NODE_SETTINGS:
            value = getattr(node, each.field)
            if not each.library:
                self._rest[each.field] = value
            elif value:
                setattr(self, each.library, value.value if isinstance(value, Enum) else value)
        self.remap_args, self.env_args = [list(pair) for pair in node.remappings], [*node.environment]
        self.filename = node.place.file if node.place else "<unknown>"


class Test(Node):
    """A test in a launch file: a node that exits after writing results."""

    __test__ = False  # pytest must not collect this class
    __slots__ = ("retry", "test_name", "time_limit")

    def __init__(
        self,
        test_name: str,
        package: str,
        node_type: str,
        name: str | None = None,
        namespace: str = "/",
        machine_name: str | None = None,
        args: str = "",
        remap_args: Iterable[Sequence[str]] | None = None,
        env_args: Iterable[Sequence[str]] | None = None,
        time_limit: float | None = None,
        cwd: str | None = None,
        launch_prefix: str | None = None,
        retry: int | None = None,
        filename: str = "<unknown>",
    ) -> None:
        super().__init__(
            package,
            node_type,
            name=name,
            namespace=namespace,
            machine_name=machine_name,
            args=args,
            remap_args=remap_args,
            env_args=env_args,
            output="log",
            cwd=cwd,
            launch_prefix=launch_prefix,
            filename=filename,
        )
        self.test_name = test_name
        self.retry = retry or 0
        limit = time_limit or TEST_TIME_LIMIT_DEFAULT
        if type(limit) not in (float, int):
            raise ValueError("'time-limit' must be a number")
        if limit <= 0:
            raise ValueError("'time-limit' must be a positive number")
        self.time_limit = float(limit)

    def to_test(self) -> model.Test:
        """Return the corresponding pipros object."""
        return model.Test(self.to_model(), self.test_name, self.time_limit, self.retry)

    @classmethod
    def from_test(cls, test: model.Test) -> Test:
        """Create a Test from the corresponding pipros object."""
        node, limit_s = test.node, test.time_limit_s
        made = cls(test.test_name, node.package, node.type, time_limit=limit_s, retry=test.retry)
        made._take(node)
        return made


class Executable:
    """A command in a configuration. pipros runs only `rosparam` commands, before it starts the nodes."""

    def __init__(self, cmd: str, args: Sequence[str], phase: str = PHASE_RUN) -> None:
        self.command = cmd
        self.args = args
        self.phase = phase

    def __str__(self) -> str:
        return f"{self.command} {' '.join(self.args)}"

    __repr__ = __str__


class RosbinExecutable(Executable):
    """A ROS command: `RosbinExecutable("rosparam", ("delete", "/x"), PHASE_SETUP)`."""

    def __str__(self) -> str:
        return f"ros/bin/{super().__str__()}"

    __repr__ = __str__


def get_master_uri_env(*args: Any) -> str:
    """Return the environment's master URI. Raises RLException if it is not a URI with a port."""
    uri = Environment.from_os(*args).master_uri
    try:
        split_master_uri(uri)
    except Exception as error:
        raise RLException(f"ERROR: {error}") from error
    return uri


def setup_env(
    node: Node, machine: Machine, master_uri: str, env: Mapping[str, str] | None = None
) -> dict[str, str]:
    """Return the environment of a node's process.

    Args:
        machine: accepted for compatibility; has no effect.
        env: the variables of the launcher; defaults to `os.environ`.
    """
    del machine
    found = {**(os.environ if env is None else env), "ROS_MASTER_URI": master_uri}
    found.pop("ROS_NAMESPACE", None)
    if node.namespace.rstrip("/"):
        found["ROS_NAMESPACE"] = node.namespace.rstrip("/")
    return {**found, **{str(name): str(value) for name, value in node.env_args}}


def remap_localhost_uri(uri: str, force_localhost: bool = False) -> str:
    """Return a URI with this computer's address if its host is `localhost`, or if that is forced.

    Raises:
        ValueError: `uri` is not a valid URL.
    """
    host, port = parse_http_host_and_port(uri)
    return create_local_xmlrpc_uri(port) if force_localhost or host == "localhost" else uri


def generate_run_id() -> str:
    """Return a new run ID."""
    return run_id.new_run_id()
