"""What rules check and plugins read. Facade of `pipros_tools.health.wtf.subject`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pipros_tools.health.wtf import graph
from pipros_tools.health.wtf.subject import CannotCheck, Subject

if TYPE_CHECKING:
    from pipros_tools.health.system_report import SystemReport
    from pipros_tools.launch.model import Launch
    from roswtf.model import WtfError

__all__ = ["WtfContext", "WtfException"]


class WtfException(Exception):
    """The context cannot be loaded, because a package is unknown or a launch file cannot be read."""


class WtfContext:
    """The environment, the packages or launch files to check, and the running system.

    Attributes:
        pkg, pkg_dir: the package to check and its folder.
        pkgs: the package and its dependencies.
        env, ros_root, ros_package_path, pythonpath, ros_master_uri: the environment.
        launch_files, launch: the launch files to check, and their contents.
        roslaunch_uris: the URIs of running launchers.
        system_state, nodes, topics, services, service_providers: the registrations with the master.
        uri_node_map: mapping from slave API URIs to nodes.
        use_sim_time: the value of the parameter `/use_sim_time`.
        expected_edges, actual_edges: connections as (publisher, subscriber, topic), as registered with the
            master and as reported by the nodes.
        unconnected_subscriptions: mapping from nodes to their subscribed topics without a publisher.
        errors, warnings: the problems found so far.
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
        self.ros_master_uri = ""
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
        self.warnings: list[WtfError] = []
        self.errors: list[WtfError] = []
        self.rospack: Any = None
        self.rosstack: Any = None
        self.set_subject(Subject.from_variables({}))

    def as_dictionary(self) -> dict[str, Any]:
        """Return the attributes by name, for use in rule texts."""
        return dict(vars(self))

    @staticmethod
    def from_env(env: Mapping[str, str] | None = None) -> WtfContext:
        """Return a context with only the environment, which defaults to this process's."""
        return _context_of(Subject.from_variables(env))

    @staticmethod
    def from_package(pkg: str, env: Mapping[str, str] | None = None) -> WtfContext:
        """Return a context with the environment, a package and its dependencies.

        Raises:
            WtfException: the package or a dependency does not exist or is invalid.
        """
        try:
            return _context_of(Subject.from_variables(env).with_package(pkg))
        except CannotCheck as error:
            raise WtfException(str(error)) from None

    @staticmethod
    def from_stack(stack: str, env: Mapping[str, str] | None = None) -> WtfContext:
        """Like `from_package`, because every catkin package is its own stack."""
        ctx = WtfContext.from_package(stack, env)
        ctx.stack, ctx.stack_dir, ctx.stacks = stack, ctx.pkg_dir, [stack]
        return ctx

    @staticmethod
    def from_roslaunch(roslaunch_files: Sequence[str], env: Mapping[str, str] | None = None) -> WtfContext:
        """Return a context with the environment and launch files. The first file determines the package.

        Raises:
            WtfException: a file cannot be loaded.
        """
        try:
            return _context_of(Subject.from_variables(env).with_launch_files(roslaunch_files, {}))
        except CannotCheck as error:
            raise WtfException(str(error)) from None

    def set_subject(self, subject: Subject) -> None:
        """Set the attributes that describe the subject to check. (Not in Noetic.)"""
        self.env = subject.variables
        self.ros_root = subject.variables.get("ROS_ROOT")
        self.ros_package_path = subject.variables.get("ROS_PACKAGE_PATH")
        self.pythonpath = subject.variables.get("PYTHONPATH")
        self.ros_master_uri = subject.master_uri
        self.pkgs = list(subject.packages)
        self.launch_files = list(subject.launch_files) or None
        self.roslaunch_uris = list(subject.launcher_uris) or None
        if package := subject.package:
            self.pkg, self.pkg_dir, self.manifest = package.name, str(package.folder), package.manifest
            self.manifest_file = str(package.folder / "package.xml")
        if subject.launch is not None:
            self._set_dependencies(subject, subject.launch)
        if subject.system is not None:
            self._set_system(subject.system)

    def _set_dependencies(self, subject: Subject, launch: Launch) -> None:
        from pipros_tools.launch.check import needed_packages

        needed = needed_packages(launch, subject.index)
        self.launch_file_deps = {file: sorted(needed) for file in subject.launch_files}
        if package := subject.package:
            declared = {package.name, *package.manifest.depends()}
            self.launch_file_missing_deps = {package.name: needed - declared}

    def _set_system(self, system: SystemReport) -> None:
        state = system.state
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
        self.expected_edges = graph.expected_links(system)
        self.actual_edges = graph.actual_links(system)
        self.unconnected_subscriptions = graph.topics_without_publisher(system)


def _context_of(subject: Subject) -> WtfContext:
    ctx = WtfContext()
    ctx.set_subject(subject)
    return ctx
