"""The contents of launch files, under Noetic's names."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.launch.model import Argument, Launch, Machine
from pipros.launch.xml import load
from roslaunch.core import Node, Param, Test
from roslaunch.rlutil import FileAndArguments, split_file


class ROSLaunchConfig:
    """Nodes, tests, parameters and machines of launch files."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.nodes_core: list[Node] = []
        self.tests: list[Test] = []
        self.params: dict[str, Param] = {}
        self.clear_params: list[str] = []
        self.machines: dict[str, Machine] = {}
        self.roslaunch_files: list[str] = []
        self.resolved_node_names: list[str] = []
        self.config_errors: list[str] = []
        self.arguments: list[Argument] = []

    def add(self, launch: Launch) -> None:
        """Adds the contents of a launch."""
        self.nodes += [Node.from_model(node) for node in launch.nodes]
        self.tests += [Test.of(test) for test in launch.tests]
        self.params |= {key: Param(key, value) for key, value in launch.params.items()}
        self.clear_params += launch.clear_params
        self.machines |= launch.machines
        self.roslaunch_files += launch.files
        self.resolved_node_names += [node.full_name for node in launch.nodes]
        self.config_errors += launch.warnings
        self.arguments += launch.arguments


def load_config_default(
    roslaunch_files: Sequence[FileAndArguments],
    port: int | None = None,
    roslaunch_strs: Sequence[str] | None = None,
    loader: object = None,
    verbose: bool = False,
    assign_machines: bool = True,
    ignore_unset_args: bool = False,
) -> ROSLaunchConfig:
    """Loads launch files.

    Raises:
        RLException: with file, line and element.
    """
    _ = port, loader, verbose, assign_machines
    unset_as = "" if ignore_unset_args else None
    config = ROSLaunchConfig()
    for entry in roslaunch_files:
        file, arguments = split_file(entry)
        config.add(load([file], arguments, unset_as=unset_as))
    for text in roslaunch_strs or ():
        config.add(load([], texts=[text], unset_as=unset_as))
    return config
