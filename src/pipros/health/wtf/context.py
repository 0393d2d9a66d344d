"""The context of the `roswtf` rules. Its attributes have Noetic's names, because plugins read them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipros.basics.env import Environment
from pipros.basics.errors import NotFound, PiprosError
from pipros.health.system_report import SystemReport
from pipros.workspace.index import PackageIndex

if TYPE_CHECKING:
    from pipros.launch.model import Launch


class WtfException(Exception):
    """The context cannot be loaded: an unknown package, or a launch file that cannot be read."""


class WtfContext:
    """The setup of a shell, the packages or launch files to check, and the running system.

    Attributes:
        pkg, pkg_dir: the package to check and its folder.
        pkgs: the package and its dependencies.
        env, ros_root, ros_package_path, pythonpath, ros_master_uri: the environment.
        launch_files, launch: the launch files to check, and their contents.
        roslaunch_uris: the addresses of running launchers.
        system_state, nodes, topics, services, service_providers: the registrations at the master.
        uri_node_map: address to node.
        use_sim_time: the parameter of that name.
        expected_edges, actual_edges: (publisher, subscriber, topic) by the registrations, and by the nodes.
        unconnected_subscriptions: node to its subscribed topics without a publisher.
        errors, warnings: the problems found so far.
        system: the complete report on the running system.
    """

    def __init__(self) -> None:
        self.pkg: str | None = None
        self.pkg_dir: str | None = None
        self.pkgs: list[str] = []
        self.stack: str | None = None
        self.stack_dir: str | None = None
        self.stacks: list[str] = []
        self.manifest_file: str | None = None
        self.manifest: Any = None
        self.env: Mapping[str, str] = {}
        self.ros_root: str | None = None
        self.ros_package_path: str | None = None
        self.pythonpath: str | None = None
        self.ros_master_uri = Environment().master_uri
        self.roslaunch_uris: list[str] | None = None
        self.launch_files: list[str] | None = None
        self.launch_file_deps: dict[str, Any] | None = None
        self.launch_file_missing_deps: dict[str, set[str]] | None = None
        self.system_state: Any = None
        self.service_providers: list[str] | None = None
        self.topics: list[str] | None = None
        self.services: list[str] | None = None
        self.nodes: list[str] | None = None
        self.uri_node_map: dict[str, str] = {}
        self.expected_edges: set[tuple[str, str, str]] | None = None
        self.actual_edges: set[tuple[str, str, str]] | None = None
        self.unconnected_subscriptions: dict[str, list[str]] | None = None
        self.use_sim_time: bool | None = None
        self.warnings: list[Any] = []
        self.errors: list[Any] = []
        self.rospack: Any = None
        self.rosstack: Any = None
        self.launch: Launch | None = None
        self.index: PackageIndex | None = None
        self.system: SystemReport | None = None

    def as_dictionary(self) -> dict[str, Any]:
        """Return the attributes by name, for formatting the texts of rules."""
        return dict(vars(self))

    @staticmethod
    def from_env(env: Mapping[str, str] | None = None) -> WtfContext:
        """Return a context with only the environment, which defaults to this process's."""
        ctx = WtfContext()
        values = dict(os.environ if env is None else env)
        ctx.env = values
        ctx.ros_root = values.get("ROS_ROOT")
        ctx.ros_package_path = values.get("ROS_PACKAGE_PATH")
        ctx.pythonpath = values.get("PYTHONPATH")
        ctx.ros_master_uri = values.get("ROS_MASTER_URI", Environment().master_uri)
        ctx.index = PackageIndex.from_environment(Environment.from_os(values))
        return ctx

    @staticmethod
    def from_package(pkg: str, env: Mapping[str, str] | None = None) -> WtfContext:
        """Return a context with the environment, a package and its dependencies.

        Raises:
            WtfException: the package or a dependency does not exist or is invalid.
        """
        ctx = WtfContext.from_env(env)
        ctx.set_package(pkg)
        return ctx

    @staticmethod
    def from_stack(stack: str, env: Mapping[str, str] | None = None) -> WtfContext:
        """Call `from_package`: since catkin, each package is its own stack."""
        ctx = WtfContext.from_package(stack, env)
        ctx.stack, ctx.stack_dir, ctx.stacks = stack, ctx.pkg_dir, [stack]
        return ctx

    @staticmethod
    def from_roslaunch(
        roslaunch_files: Sequence[str],
        env: Mapping[str, str] | None = None,
        arguments: Mapping[str, str] | None = None,
    ) -> WtfContext:
        """Return a context with the environment and launch files; the first file determines the package.

        Raises:
            WtfException: a file cannot be loaded.
        """
        from pipros.launch.check import needed_packages
        from pipros.launch.load_context import LoadContext
        from pipros.launch.xml import load
        from pipros.workspace.manifest import read_manifest

        ctx = WtfContext.from_env(env)
        index = ctx.index or PackageIndex.from_environment()
        files = list(roslaunch_files)
        for file in files:
            if not Path(file).is_file():
                raise WtfException(f"Unable to load roslaunch file [{file}]: no such file")
        try:
            ctx.launch = load(files, arguments or {}, context=LoadContext.of_process(index))
        except PiprosError as error:
            raise WtfException(f"Unable to load roslaunch file [{', '.join(files)}]: {error}") from None
        ctx.launch_files = files
        ctx.launch_file_deps = {file: sorted(needed_packages(ctx.launch, index)) for file in files}
        owner = index.containing(Path(files[0])) if files else None
        if owner is not None:
            ctx.set_package(owner.name)
            declared = {owner.name, *read_manifest(owner.path).depends()}
            ctx.launch_file_missing_deps = {owner.name: needed_packages(ctx.launch, index) - declared}
        return ctx

    def set_package(self, name: str) -> None:
        """Set the package to check. Raises the same errors as `from_package`."""
        from pipros.workspace.dependency_graph import DependencyGraph

        index = self.index or PackageIndex.from_environment()
        graph = DependencyGraph(index)
        try:
            package = index.find(name)
            self.pkgs = [name, *graph.all(name)]
            self.manifest = graph.manifest(name)
        except NotFound as error:
            raise WtfException(f"Cannot find dependencies for package [{name}]: missing {error}") from None
        except (PiprosError, OSError) as error:
            raise WtfException(f"Cannot load the manifest of package [{name}]: {error}") from None
        self.pkg, self.pkg_dir = name, str(package.path)
        self.manifest_file = str(package.path / "package.xml")

    def set_system(self, system: SystemReport) -> None:
        """Set the attributes that describe the running system."""
        state = system.state
        self.system = system
        self.system_state = [
            [[name, list(nodes)] for name, nodes in kind.items()]
            for kind in (state.publishers, state.subscribers, state.services)
        ]
        self.nodes = list(state.nodes())
        self.topics = state.topics()
        self.services = sorted(state.services)
        self.service_providers = sorted({node for nodes in state.services.values() for node in nodes})
        self.uri_node_map = {report.api: node for node, report in system.nodes.items() if report.api}
        self.use_sim_time = system.is_time_simulated
        self.expected_edges = {
            (publisher, subscriber, topic)
            for topic, publishers in state.publishers.items()
            for publisher in publishers
            for subscriber in state.subscribers.get(topic, ())
        }
        self.actual_edges = _actual_edges(system)
        self.unconnected_subscriptions = {}
        for topic, subscribers in state.subscribers.items():
            if not state.publishers.get(topic):
                for node in subscribers:
                    self.unconnected_subscriptions.setdefault(node, []).append(topic)


def _actual_edges(system: SystemReport) -> set[tuple[str, str, str]]:
    services = set(system.state.services)
    edges = set()
    for node, report in system.nodes.items():
        for link in report.connections:
            for peer in () if link.topic in services else system.nodes_at(link.peer):
                if link.direction in ("o", "b"):
                    edges.add((node, peer, link.topic))
                if link.direction in ("i", "b"):
                    edges.add((peer, node, link.topic))
    return edges
