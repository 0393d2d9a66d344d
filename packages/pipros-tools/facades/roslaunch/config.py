"""Configuration loaded from launch files, in classes and functions with Noetic's names."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pipros.basics import names
from pipros.basics.env import DEFAULT_MASTER_PORT
from pipros_tools.launch import announcements, model
from pipros_tools.launch.model import ParameterAction, ParameterCommand
from pipros_tools.launch.roscore import ROS_DISTRO
from rosgraph.network import create_local_xmlrpc_uri
from roslaunch.core import (
    Executable,
    FileAndArguments,
    Machine,
    Master,
    Node,
    Param,
    RLException,
    RosbinExecutable,
    Test,
    is_machine_local,
    local_machine,
)

if TYPE_CHECKING:
    from roslaunch.xmlloader import XmlLoader

__all__ = [
    "DEFAULT_MASTER_PORT",
    "Master",
    "RLException",
    "ROSLaunchConfig",
    "calculate_env_loader",
    "get_roscore_filename",
    "is_machine_local",
    "load_config_default",
    "load_roscore",
    "local_machine",
    "namespaces_of",
]


def namespaces_of(name: str | None) -> list[str]:
    """Return the parent namespaces of a name, outermost first: `["/", "/a"]` for `/a/b`.

    Raises:
        ValueError: the name is None.
        TypeError: the name is not a string.
    """
    if not isinstance(name, str):
        raise ValueError("name") if name is None else TypeError("name")
    parts = [part for part in name.split("/") if part]
    return ["/", *("/" + "/".join(parts[:count]) for count in range(1, len(parts)))]


def get_roscore_filename() -> str:
    """Return the path of the core's launch file."""
    from pipros_workspace.index import PackageIndex

    return str(PackageIndex.from_environment().find("roslaunch").path / "resources" / "roscore.xml")


def load_roscore(loader: XmlLoader, config: ROSLaunchConfig, verbose: bool = True) -> None:
    """Load the core's launch file into the configuration."""
    loader.load(get_roscore_filename(), config, core=True, verbose=verbose)


def calculate_env_loader(env: Mapping[str, str] | None = None) -> str:
    """Return the path of the env-loader script in a Noetic installation on another computer."""
    _ = env
    return f"/opt/ros/{ROS_DISTRO}/env.sh"


class ROSLaunchConfig:
    """Nodes, tests, parameters and machines from launch files. The local machine's name is "".

    `to_launch` converts a configuration to the corresponding pipros object.
    """

    def __init__(self) -> None:
        self.master = Master()
        self.nodes_core: list[Node] = []
        self.nodes: list[Node] = []
        self.roslaunch_files: list[str] = []
        self.resolved_node_names: list[str] = []
        self.tests: list[Test] = []
        self.machines: dict[str, Machine] = {"": local_machine()}
        self.params: dict[str, Param] = {}
        self.clear_params: list[str] = []
        self.executables: list[Executable] = []
        self.config_errors: list[str] = []
        self.logger = logging.getLogger("roslaunch")
        self._has_remote_nodes: bool | None = None

    def add_roslaunch_file(self, f: str) -> None:
        """Record a launch file that was read."""
        self.roslaunch_files.append(f)

    def add_config_error(self, msg: str) -> None:
        """Record an error that does not prevent the launch."""
        self.config_errors.append(msg)

    def set_master(self, m: Master) -> None:
        """Set the master to use instead of the one at `ROS_MASTER_URI`."""
        self.master = m

    def has_remote_nodes(self) -> bool:
        """Return whether a node runs on another computer.

        Raises:
            RLException: machines have not been assigned yet.
        """
        if self._has_remote_nodes is None:
            raise RLException("ERROR: has_remote_nodes() cannot be called until prelaunch check is complete")
        return self._has_remote_nodes

    def assign_machines(self) -> None:
        """Set the `machine` of all nodes and tests. Of machines with equal settings, only the first is used.

        Raises:
            RLException: a machine is not defined, or its address cannot be resolved.
        """
        if self._has_remote_nodes is not None:
            return
        for node in self.nodes_core:
            node.machine = self.machines[""]
        used: dict[str, Machine] = {}
        for node in (*self.nodes, *self.tests):
            name = node.machine_name or ""
            if name not in self.machines:
                raise RLException(f"ERROR: unknown machine [{name}]")
            machine = self.machines[name]
            node.machine = used.setdefault(machine.config_key(), machine)
        self._has_remote_nodes = not all(map(is_machine_local, used.values()))

    def summary(self, local: bool = False) -> str:
        """Return the lists of parameters, machines and nodes in roslaunch's output format.

        Args:
            local: whether to omit machines, and nodes on other machines.
        """
        nodes = [
            node for node in self.nodes if not local or node.machine is None or is_machine_local(node.machine)
        ]
        return announcements.summary(
            {key: param.value for key, param in self.params.items()},
            [node.to_model() for node in nodes],
            machines=() if local else [name for name in self.machines if name],
            has_machines=not local,
            cleared=self.clear_params,
        )

    def add_executable(self, exe: Executable) -> None:
        """Add a command.

        Raises:
            ValueError: the command is None.
        """
        if not exe:
            raise ValueError("exe is None")
        self.executables.append(exe)

    def add_clear_param(self, param: str) -> None:
        """Add a namespace whose parameters are deleted before the launch."""
        self.clear_params.append(param)

    def add_param(self, p: Param, filename: str | None = None, verbose: bool = True) -> None:
        """Add a parameter, replacing any parameter with the same name."""
        _ = filename
        for parent in namespaces_of(p.key):
            if parent in self.params:
                self.add_config_error(f"parameter [{p.key}] conflicts with parent parameter [{parent}]")
        self.params[p.key] = p
        if verbose:
            print(f"Added parameter [{p.key}]")

    def add_machine(self, m: Machine, verbose: bool = True) -> bool:
        """Add a machine. Return False if it was already added.

        Raises:
            RLException: a different machine has the same name.
        """
        if m.name in self.machines:
            if m != self.machines[m.name]:
                raise RLException(f"Machine [{m.name}] already added and does not match duplicate entry")
            return False
        self.machines[m.name] = m
        if verbose:
            print(f"Added machine [{m.name}]")
        return True

    def add_test(self, test: Test, verbose: bool = True) -> None:
        """Add a test."""
        _ = verbose
        self.tests.append(test)

    def add_node(self, node: Node, core: bool = False, verbose: bool = True) -> None:
        """Add a node.

        Args:
            core: whether the node belongs to the core, like `/rosout`.

        Raises:
            RLException: another node has the same name, or a core node does not have a name.
        """
        if node.name:
            name = names.join(node.namespace, node.name)
            if name in self.resolved_node_names:
                raise RLException(
                    f"roslaunch file contains multiple nodes named [{name}].\n"
                    "Please check all <node> 'name' attributes to make sure they are unique.\n"
                    "Also check that $(anon id) use different ids."
                )
            self.resolved_node_names.append(name)
        elif core:
            raise RLException(f"ROS core nodes must have a name. [{node.package}/{node.type}]")
        (self.nodes_core if core else self.nodes).append(node)
        if verbose:
            kind = "core node" if core else "node"
            print(f"Added {kind} of type [{node.package}/{node.type}] in namespace [{node.namespace}]")

    def to_launch(self) -> model.Launch:
        """Return the corresponding pipros object, without the core's nodes."""
        return model.Launch(
            files=tuple(self.roslaunch_files),
            params={key: param.value for key, param in self.params.items()},
            clear_params=tuple(self.clear_params),
            commands=tuple(
                _command(executable.args)
                for executable in self.executables
                if isinstance(executable, RosbinExecutable) and executable.command == "rosparam"
            ),
            nodes=tuple(node.to_model() for node in self.nodes),
            tests=tuple(test.to_test() for test in self.tests),
            machines={name: machine.to_model() for name, machine in self.machines.items() if name},
            warnings=tuple(self.config_errors),
        )


def _command(words: Sequence[Any]) -> ParameterCommand:
    """Convert `rosparam` arguments, such as `("dump", "/file", "/ns")`, to a ParameterCommand."""
    action, *rest = words
    key = rest[-1] if rest else "/"
    return ParameterCommand(ParameterAction(action), key, (rest[0] or "") if len(rest) > 1 else "")


def load_config_default(
    roslaunch_files: Sequence[FileAndArguments],
    port: int | None,
    roslaunch_strs: Sequence[str] | None = None,
    loader: XmlLoader | None = None,
    verbose: bool = False,
    assign_machines: bool = True,
    ignore_unset_args: bool = False,
) -> ROSLaunchConfig:
    """Load the core's launch file, then the given files.

    Args:
        roslaunch_files: paths, or pairs of a path and its command-line arguments.
        port: the port of the master; defaults to the port in `ROS_MASTER_URI`.
        roslaunch_strs: contents of further launch files.

    Raises:
        RLException: a file is invalid. The message names the file, line and element.
    """
    from roslaunch.xmlloader import XmlLoader

    config = ROSLaunchConfig()
    if port:
        config.master.uri = create_local_xmlrpc_uri(port)
    loader = loader or XmlLoader()
    loader.ignore_unset_args = ignore_unset_args
    load_roscore(loader, config, verbose=verbose)
    for entry in roslaunch_files:
        _load_file(loader, config, entry, verbose)
    for text in roslaunch_strs or ():
        _load_string(loader, config, text)
    if assign_machines:
        config.assign_machines()
    return config


def _load_file(loader: XmlLoader, config: ROSLaunchConfig, entry: FileAndArguments, verbose: bool) -> None:
    file, words = (entry, None) if isinstance(entry, str) else entry
    try:
        loader.load(file, config, argv=words, verbose=verbose)
    except RLException as error:
        raise RLException(error.reason, error.places, error.element) from error


def _load_string(loader: XmlLoader, config: ROSLaunchConfig, text: str) -> None:
    try:
        loader.load_string(text, config)
    except RLException as error:
        raise RLException(f"Launch string: {text}\nException: {error}") from error
