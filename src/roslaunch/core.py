"""The parts of a launch, under Noetic's names."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from pipros import names
from pipros.launch import model
from pipros.launch.model import LaunchError, Machine

RLException = LaunchError
"""The class of all errors of roslaunch."""

__all__ = ["Machine", "Node", "Param", "RLException", "Test"]


@dataclass
class Param:
    """A parameter with its full name."""

    key: str
    value: Any


class Node:
    """A node to launch: `Node("rospy_tutorials", "talker.py", name="talker")`."""

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
        if not package or not package.strip():
            raise ValueError("package must be non-empty")
        if not node_type or not node_type.strip():
            raise ValueError("type must be non-empty")
        if respawn and required:
            raise ValueError("respawn and required cannot both be set to true")
        if output not in (None, "log", "screen"):
            raise ValueError("output must be one of 'log', 'screen'")
        if cwd not in (None, "ROS_HOME", "node"):
            raise ValueError("cwd must be one of 'ROS_HOME', 'node'")
        self.package = package
        self.type = node_type
        self.name = name or None
        self.namespace = names.make_global_namespace(namespace or "/")
        self.machine_name = machine_name or None
        self.args = args or ""
        self.respawn = respawn
        self.respawn_delay = respawn_delay
        self.remap_args = [list(pair) for pair in remap_args or []]
        self.env_args = [tuple(pair) for pair in env_args or []]
        self.output = output
        self.cwd = cwd
        self.launch_prefix = launch_prefix or None
        self.required = required
        self.filename = filename

    def to_model(self) -> model.Node:
        """The node as a value of pipros; without a name it is named after its program."""
        name = self.name or names.anonymous(self.type.replace(".", "_"))
        return model.Node(
            package=self.package,
            type=self.type,
            name=name,
            namespace=self.namespace,
            arguments=self.args,
            remappings=tuple((source, target) for source, target in self.remap_args),
            environment=tuple((key, value) for key, value in self.env_args),
            machine=self.machine_name or "",
            respawn=self.respawn,
            respawn_delay_s=self.respawn_delay,
            required=self.required,
            output=model.Output(self.output or "log"),
            working_folder=model.WorkingFolder(self.cwd or "ROS_HOME"),
            launch_prefix=self.launch_prefix or "",
        )

    @classmethod
    def from_model(cls, node: model.Node) -> Node:
        """The node of a launch file, under Noetic's names."""
        return cls(
            node.package,
            node.type,
            node.name,
            node.namespace,
            node.machine or None,
            node.arguments,
            node.respawn,
            node.respawn_delay_s,
            node.remappings,
            node.environment,
            node.output.value,
            None if node.working_folder is model.WorkingFolder.ROS_HOME else node.working_folder.value,
            node.launch_prefix or None,
            node.required,
            node.place.file if node.place else "<unknown>",
        )

    def __repr__(self) -> str:
        return f"Node({self.package!r}, {self.type!r}, name={self.name!r}, namespace={self.namespace!r})"


class Test(Node):
    """A test of a launch file."""

    __test__ = False
    test_name: str
    time_limit: float
    retry: int

    @classmethod
    def of(cls, test: model.Test) -> Test:
        """The test of a launch file, under Noetic's names."""
        made = cls.from_model(test.node)
        assert isinstance(made, cls)  # noqa: S101  # from_model makes instances of this class
        made.test_name = test.test_name
        made.time_limit = test.time_limit_s
        made.retry = test.retry
        return made
