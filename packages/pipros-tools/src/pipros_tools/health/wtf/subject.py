"""`Subject`, the argument of all `roswtf` rules."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.env import DEFAULT_MASTER_URI, Environment
from pipros.basics.errors import NotFound, PiprosError
from pipros_tools.health.system_report import SystemReport
from pipros_workspace.index import PackageIndex

if TYPE_CHECKING:
    from pipros_tools.launch.model import Launch
    from pipros_workspace.manifest import Manifest


class CannotCheck(PiprosError):
    """The subject is an unknown package, or a launch file that cannot be read."""


@dataclass(frozen=True, slots=True)
class CheckedPackage:
    """A package, with the names of all packages that it depends on."""

    name: str
    folder: Path
    dependencies: tuple[str, ...]
    manifest: Manifest


@dataclass(frozen=True, slots=True)
class Subject:
    """The environment, the packages or launch files to check, and the running system.

    Attributes:
        variables: the environment variables.
        package: the package to check: a given package, or the package that contains the first launch file.
        packages: the names of all packages to check, including dependencies.
        launch: the contents of the launch files.
        system: the running system; None before `graph.with_running_system`.
        launcher_uris: the addresses of running launchers.
    """

    variables: Mapping[str, str]
    index: PackageIndex
    package: CheckedPackage | None = None
    packages: tuple[str, ...] = ()
    launch_files: tuple[str, ...] = ()
    launch: Launch | None = None
    system: SystemReport | None = None
    launcher_uris: tuple[str, ...] = ()

    @classmethod
    def from_variables(cls, variables: Mapping[str, str] | None = None) -> Subject:
        """Return a subject that consists only of the environment, which defaults to this process's."""
        variables = dict(os.environ if variables is None else variables)
        return cls(variables, PackageIndex.from_environment(Environment.from_os(variables)))

    @property
    def environment(self) -> Environment:
        return Environment.from_os(self.variables)

    @property
    def master_uri(self) -> str:
        """`ROS_MASTER_URI` as set, even if it is empty."""
        return self.variables.get("ROS_MASTER_URI", DEFAULT_MASTER_URI)

    @property
    def words(self) -> dict[str, str]:
        """The values for placeholders in rules' messages: environment variables, keyed by lower-case name."""
        words = {name.lower(): value for name, value in self.variables.items()}
        return {**words, "ros_master_uri": self.master_uri}

    def with_package(self, name: str) -> Subject:
        """Return a copy of the subject with a package and its dependencies.

        Raises:
            CannotCheck: the package or a dependency does not exist or is invalid.
        """
        from pipros_workspace.dependency_graph import DependencyGraph

        graph = DependencyGraph(self.index)
        try:
            folder = self.index.find(name).path
            package = CheckedPackage(name, folder, tuple(graph.all(name)), graph.manifest(name))
        except NotFound as error:
            raise CannotCheck(f"Cannot find dependencies for package [{name}]: missing {error}") from None
        except (PiprosError, OSError) as error:
            raise CannotCheck(f"Cannot load the manifest of package [{name}]: {error}") from None
        return replace(self, package=package, packages=(name, *package.dependencies))

    def with_launch_files(self, files: Sequence[str], arguments: Mapping[str, str]) -> Subject:
        """Return a copy of the subject with launch files and the package that contains the first of them.

        Raises:
            CannotCheck: a file cannot be loaded, or the package or one of its dependencies is invalid.
        """
        from pipros_tools.launch.load_context import LoadContext
        from pipros_tools.launch.xml import load

        missing = [file for file in files if not Path(file).is_file()]
        if missing:
            raise CannotCheck(f"Unable to load roslaunch file [{missing[0]}]: no such file")
        try:
            launch = load(list(files), arguments, context=LoadContext.of_process(self.index))
        except PiprosError as error:
            raise CannotCheck(f"Unable to load roslaunch file [{', '.join(files)}]: {error}") from None
        found = replace(self, launch_files=tuple(files), launch=launch)
        owner = self.index.containing(Path(files[0])) if files else None
        return found if owner is None else found.with_package(owner.name)
