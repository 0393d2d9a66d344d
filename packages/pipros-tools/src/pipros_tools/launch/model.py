"""The contents of launch files as plain values that can be printed, compared and tested.

`launch.xml` builds a `Launch` from files; `launch.run` executes it. This module reads no files and starts no
processes.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

from pipros.basics.errors import PiprosError


class Place(NamedTuple):
    """The position of an element's start tag in a file; line and column are 1-based."""

    file: str
    line: int
    column: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


class LaunchError(PiprosError):
    """A launch file is invalid or cannot be executed.

    Attributes:
        reason: the mistake, in Noetic's wording if Noetic has the same error.
        places: the place of the faulty element, then those of the includes that led to it, innermost first.
        element: the faulty element as written, shortened; empty if no element is at fault.
    """

    def __init__(self, reason: str, places: Sequence[Place] = (), element: str = "") -> None:
        self.reason = reason
        self.places = tuple(places)
        self.element = element
        lines = [reason]
        for number, place in enumerate(self.places):
            lines.append(f"  included from {place}" if number else f"  in {place}: {element}".rstrip(": "))
        super().__init__("\n".join(lines))


class Output(enum.Enum):
    """Destination of a node's standard output.

    In a launch child, the destination also applies to standard error, which otherwise goes to the screen.
    """

    LOG = "log"
    SCREEN = "screen"


class WorkingFolder(enum.Enum):
    """The working directory of a node. As in Noetic, `ros_home` is the only other spelling of a value."""

    ROS_HOME = "ROS_HOME"
    NODE = "node"

    @classmethod
    def _missing_(cls, value: object) -> WorkingFolder | None:
        return cls.ROS_HOME if value == "ros_home" else None


def _named(
    xml: str = "",
    library: str = "",
    ros2: str = "",
    choices: type[enum.Enum] | None = None,
    *,
    in_tests: bool = True,
) -> dict[str, Any]:
    return {"xml": xml, "library": library, "ros2": ros2, "choices": choices, "in_tests": in_tests}


@dataclass(frozen=True, slots=True)
class LaunchNode:
    """A process to start. `NODE_SETTINGS` has the names of the fields elsewhere.

    Attributes:
        namespace: the namespace, with a leading and a trailing slash.
        arguments: the arguments as written; split into words by shell rules when the node is started.
        remappings: pairs (from, to) in order of declaration, outer scopes first.
        environment: pairs (name, value); later pairs win.
        machine: the name of a `Machine`; empty for this computer.
        output: None if unspecified; standard output is then written to the log.
        working_folder: None if unspecified; ROS_HOME is then used.
        launch_prefix: words before the command, as written.
        ros2_python: the Python that runs a script for rclpy; empty for that of its first line.
    """

    package: str = field(metadata=_named("pkg", "package", "package"))
    type: str = field(metadata=_named("type", "type", "executable"))
    name: str = field(metadata=_named("name", "name", "name"))
    namespace: str = field(default="/", metadata=_named("ns", "namespace", "namespace"))
    arguments: str = field(default="", metadata=_named("args", "args", "arguments"))
    remappings: tuple[tuple[str, str], ...] = field(
        default=(), metadata=_named("", "remap_args", "remappings")
    )
    environment: tuple[tuple[str, str], ...] = field(
        default=(), metadata=_named("", "env_args", "additional_env")
    )
    launch_prefix: str = field(default="", metadata=_named("launch-prefix", "launch_prefix", "prefix"))
    output: Output | None = field(
        default=None, metadata=_named("output", "output", "output", Output, in_tests=False)
    )
    respawn: bool = field(default=False, metadata=_named("respawn", "respawn", "respawn", in_tests=False))
    respawn_delay_s: float = field(
        default=0.0, metadata=_named("respawn_delay", "respawn_delay", "respawn_delay", in_tests=False)
    )
    required: bool = field(default=False, metadata=_named("required", "required", "on_exit"))
    machine: str = field(default="", metadata=_named("machine", "machine_name"))
    working_folder: WorkingFolder | None = field(
        default=None, metadata=_named("cwd", "cwd", "", WorkingFolder)
    )
    ros2_python: str = field(default="", metadata=_named())
    place: Place | None = field(default=None, compare=False, metadata=_named())

    @property
    def full_name(self) -> str:
        """The name in the graph: `/ns/name`."""
        return self.namespace + self.name


class NodeSetting(NamedTuple):
    """A field of `LaunchNode`, and its names elsewhere, which are empty if it has none.

    Attributes:
        default: the default of the field; `dataclasses.MISSING` if it must be given.
        xml: the attribute of `<node>`.
        library: the attribute of nodes in Noetic's Python library.
        ros2: the argument of `Node` in Python launch files of ROS 2.
        choices: the values that it may have; None if it may have any of its type.
        in_tests: whether `<test>` may have the attribute, too.
    """

    field: str
    default: Any
    xml: str
    library: str
    ros2: str
    choices: type[enum.Enum] | None
    in_tests: bool


NODE_SETTINGS = tuple(NodeSetting(each.name, each.default, **each.metadata) for each in fields(LaunchNode))
NODE_ATTRIBUTES = (*(each.xml for each in NODE_SETTINGS if each.xml), "clear_params")
"""The attributes of `<node>`, besides `if` and `unless`."""


class Test(NamedTuple):
    """A `<test>`: a process that reports results and exits. roslaunch ignores tests; rostest runs them."""

    node: LaunchNode
    test_name: str
    time_limit_s: float = 60.0
    retry: int = 0


@dataclass(frozen=True, slots=True)
class Machine:
    """A computer and a user for starting nodes.

    Nodes are started through ssh, unless the machine is this computer and its user is this process's user.

    Attributes:
        env_loader: a script on that computer that sets up ROS and runs its arguments.
        is_default: whether later nodes without a machine run on it.
    """

    name: str
    address: str
    user: str = ""
    password: str = field(default="", repr=False)
    ssh_port: int = 22
    env_loader: str = ""
    timeout_s: float = 10.0
    is_default: bool = False
    place: Place | None = field(default=None, compare=False)


class ParameterAction(enum.Enum):
    DUMP = "dump"
    DELETE = "delete"


class ParameterCommand(NamedTuple):
    """A `<rosparam>` that dumps or deletes parameters on the server, before the launch sets parameters."""

    action: ParameterAction
    key: str
    file: str = ""


class Argument(NamedTuple):
    """An `<arg>`: fixed if it has a value, optional if it has a default, otherwise required."""

    name: str
    default: str | None = None
    value: str | None = None
    doc: str | None = None

    @property
    def is_required(self) -> bool:
        return self.default is None and self.value is None


@dataclass(frozen=True, slots=True)
class Launch:
    """The combined contents of one or more launch files.

    Attributes:
        files: the files, in the order in which they were read.
        includes: pairs (file, included file).
        params: values by full name, in the order in which they were set.
        clear_params: namespaces to delete first, each with a trailing slash.
        arguments: the `<arg>`s of the files themselves, excluding `<arg>`s of included files.
        warnings: errors that do not prevent the launch.
    """

    files: tuple[str, ...] = ()
    params: Mapping[str, Any] = field(default_factory=dict)
    clear_params: tuple[str, ...] = ()
    commands: tuple[ParameterCommand, ...] = ()
    nodes: tuple[LaunchNode, ...] = ()
    tests: tuple[Test, ...] = ()
    machines: Mapping[str, Machine] = field(default_factory=dict)
    arguments: tuple[Argument, ...] = ()
    warnings: tuple[str, ...] = ()
    includes: tuple[tuple[str, str], ...] = ()

    def node(self, full_name: str) -> LaunchNode | None:
        """Return the node or test with the given full name, or None."""
        return next((node for node in self._nodes_and_tests() if node.full_name == full_name), None)

    def check_machines(self) -> None:
        """Check that all machines used by nodes are defined. Call this before starting anything.

        Tools that only inspect a launch may skip this check.

        Raises:
            LaunchError: a node is on a machine that no file defines.
        """
        for node in self._nodes_and_tests():
            if node.machine and node.machine not in self.machines:
                raise LaunchError(
                    f"ERROR: unknown machine [{node.machine}]", [node.place] if node.place else ()
                )

    def _nodes_and_tests(self) -> tuple[LaunchNode, ...]:
        return (*self.nodes, *(test.node for test in self.tests))
