"""Build a catkin workspace: check each package, write its devel files, and install it if requested.

Packages with only Python, messages, launch files and data need neither CMake nor a compiler. Packages with
compiled code are built by genuine catkin and CMake (`genuine_catkin.py`) if these are installed. If a package
fails, packages that depend on it are skipped, and all others are built. If only the compiled part of a
package fails, its messages and Python code are built, and only the compiled parts of packages that depend on
it are skipped.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.errors import NotFound, PiprosError
from pipros.basics.windows import relative_path
from pipros.msg.language.definition_files import DefinitionFiles
from pipros.msg.language.definitions import Definitions
from pipros.msg.language.spec import DefinitionError
from pipros.msg.stubs import write_stubs
from pipros.safe.xml import XmlError
from pipros_workspace import genuine_catkin, native_tools
from pipros_workspace.build_failures import BuildFailures
from pipros_workspace.build_options import BuildOptions
from pipros_workspace.build_result import BuildResult
from pipros_workspace.build_state import BuildState
from pipros_workspace.catkin.cmake_shim import cmake_program
from pipros_workspace.catkin.context import FindPackage, FoundPackage
from pipros_workspace.catkin.project import NativeTarget, Project
from pipros_workspace.catkin.project_reader import extras_in
from pipros_workspace.catkin.step_runner import StepRunner
from pipros_workspace.checked_package import read_checked
from pipros_workspace.cmake_runs import NativeBuildFailed
from pipros_workspace.devel import (
    install_package,
    python_setup,
    write_devel_files,
    write_over_genuine,
)
from pipros_workspace.environment import underlays_of_build
from pipros_workspace.executables import shipped_programs
from pipros_workspace.index import PackageIndex
from pipros_workspace.layout import (
    SourcePackage,
    WorkspaceError,
    WorkspaceFolders,
    closure,
    read_source_space,
)
from pipros_workspace.manifest import read_manifest
from pipros_workspace.setup_files import write_setup_files

if TYPE_CHECKING:
    from pipros.basics.printable import Say


def build(
    layout: WorkspaceFolders,
    options: BuildOptions,
    say: Say,
    variables: Mapping[str, str] | None = None,
    projects: Mapping[str, Project] | None = None,
) -> BuildResult:
    """Build a workspace. Packages that fail are reported in the result, not as an exception.

    Args:
        say: called with each line to print.
        variables: the environment; defaults to the environment of this process.
        projects: packages in the workspace that earlier calls to this function built, by name.

    Raises:
        WorkspaceError: none of the packages in `options.only` exists.
        OSError: a space cannot be written.
    """
    return _Build(layout, options, say, os.environ if variables is None else variables, projects or {}).run()


class _Build:
    def __init__(
        self,
        layout: WorkspaceFolders,
        options: BuildOptions,
        say: Say,
        variables: Mapping[str, str],
        projects: Mapping[str, Project],
    ) -> None:
        self._layout = layout
        self._options = options
        self._say = say
        self._variables = variables
        self._earlier = projects
        self._result = BuildResult()
        self._state = BuildState(layout)
        self._failures = BuildFailures(self._result, say)

    def run(self) -> BuildResult:
        space = read_source_space(self._layout.source, self._variables)
        self._result.errors += space.errors
        self._failures.failed.update({name: name for name in space.left_out})
        packages = self._wanted(space.packages)
        self._announce(packages)
        by_name = {package.name: package for package in space.packages}
        index = PackageIndex.from_environment()
        extras: dict[str, list[str]] = {}

        def find_package(name: str) -> Path | None:
            package = by_name.get(name) or index.get(name)
            if package is None:
                return None
            return package.folder if isinstance(package, SourcePackage) else package.path

        def find_for_cmake(name: str) -> FoundPackage | None:
            project = self._result.projects.get(name) or self._earlier.get(name)
            if project is not None:
                return FoundPackage(str(by_name[name].manifest.version), project.cfg_extras)
            folder = find_package(name)
            if folder is not None:
                if name not in extras:
                    extras[name] = []  # while it is read, so that a cycle ends
                    settings = self._settings(self._layout.source / name)
                    extras[name] = extras_in(folder, name, settings, self._variables, find_for_cmake)
                return FoundPackage(_version_of(folder), extras[name])
            return FoundPackage() if native_tools.is_installed(name, self._variables) else None

        definitions = Definitions(DefinitionFiles(find_package))
        natives = []
        for package in packages:
            project = self._read(package, find_for_cmake, definitions, find_package)
            if project is None:
                continue
            self._result.projects[package.name] = project
            self._note_compiled_tests(project)
            if project.needs_cmake or package.name in self._options.genuine:
                natives.append(package)
            self._check_absent(package, project)
        if self._options.is_alone:
            names = {package.name for package in natives}
            self._result.needs_genuine = sorted(names - self._options.genuine)
            if self._result.needs_genuine:
                return self._result
        self._build_all(packages, natives, definitions)
        self._write_spaces(packages, definitions)
        return self._result

    def _build_all(
        self, packages: Sequence[SourcePackage], natives: list[SourcePackage], definitions: Definitions
    ) -> None:
        """Build the packages in order.

        If genuine catkin is installed, it builds `natives` and their dependencies.
        """
        self._check_reconfigure_options(natives)
        natives = [package for package in natives if not self._failures.is_broken(package)]
        native_names = {package.name for package in natives}
        if natives and native_tools.has_tools(self._variables):
            native_names = closure(packages, native_names)
        for package in packages:
            if package.name not in self._result.projects or self._failures.is_blocked(package):
                continue
            if package.name not in native_names:
                self._build_package(package, definitions)
        self._build_natives(packages, natives, native_names, definitions)

    def _write_spaces(self, packages: Sequence[SourcePackage], definitions: Definitions) -> None:
        """Write the files that do not belong to a single package, and install the packages if requested."""
        self._update_typings(definitions)
        (self._layout.build / "test_results").mkdir(parents=True, exist_ok=True)
        if self._layout.build != self._layout.source:
            # The build folder contains links to packages, which a crawl would otherwise find twice.
            (self._layout.build / "CATKIN_IGNORE").touch()
        underlays = underlays_of_build(self._variables, self._layout.devel)
        sources = self._options.sources or (self._layout.source,)
        write_setup_files(self._layout.devel, sources, underlays)
        if self._options.installs:
            self._install(packages, underlays, definitions)
        self._state.write()

    def _update_typings(self, definitions: Definitions) -> None:
        """Update the stubs in `typings`, which `pipros stubs` creates, for packages with definitions."""
        typings = self._layout.base / "typings"
        for name in (*self._result.built, *self._result.unchanged) if typings.is_dir() else ():
            project = self._result.projects[name]
            if project.interfaces:
                has_module = dict.fromkeys([name], project.has_python_setup).__getitem__
                with suppress(DefinitionError, NotFound):  # the invalid file is not listed by the package
                    write_stubs([name], typings, definitions, has_module=has_module)

    def _wanted(self, packages: Sequence[SourcePackage]) -> list[SourcePackage]:
        missing = self._options.only - {package.name for package in packages}
        if missing:
            text = f'Packages "{", ".join(sorted(missing))}" not found in the workspace'
            if missing == self._options.only:
                raise WorkspaceError("\n".join([text, *self._result.errors]))
            self._say(f"-- WARNING: {text}")
        names = set(self._options.only) or None
        if names is not None and not self._options.is_alone:
            names = closure(packages, names)
        return [
            package
            for package in packages
            if (names is None or package.name in names) and package.name not in self._options.left_out
        ]

    def _announce(self, packages: Sequence[SourcePackage]) -> None:
        rule = "-- " + "~" * 49
        if not packages:
            self._say("-- No packages in the source space yet")
            return
        self._say(rule)
        self._say(f"-- ~~  traversing {len(packages)} packages in topological order:")
        for package in packages:
            note = " (metapackage)" if package.is_metapackage else ""
            self._say(f"-- ~~  - {package.name}{note}")
        self._say(rule)

    def _read(
        self,
        package: SourcePackage,
        find_for_cmake: FindPackage,
        definitions: Definitions,
        find_folder: Callable[[str], Path | None],
    ) -> Project | None:
        """Read and check a package. If that fails, report the failure and return None."""
        self._say(f"-- +++ processing catkin package: '{package.name}'")
        try:
            return read_checked(
                package,
                self._layout.source,
                self._settings(package.folder),
                self._variables,
                find_for_cmake=find_for_cmake,
                find_folder=find_folder,
                definitions=definitions,
                say=self._say,
            )
        except PiprosError as error:
            self._fail(package, str(error))
            return None

    def _note_compiled_tests(self, project: Project) -> None:
        """Record that genuine catkin must build compiled tests, if tests will be run and it is installed."""
        compiled = [test for test in project.tests if test.target]
        if compiled and self._options.tests and native_tools.has_tools(self._variables):
            file, _, line = compiled[0].place.rpartition(":")
            what = f"compiles the test [{compiled[0].target}]"
            project.needs_cmake.append(NativeTarget(what, file, int(line)))

    def _check_absent(self, package: SourcePackage, project: Project) -> None:
        """Report required packages that were not found, as an error only if the package has compiled code."""
        if project.absent and project.needs_cmake:
            self._failures.add_native(package, project.absent[0].error)
            return
        for absent in project.absent:
            self._say(
                f"-- WARNING: {absent.place}: find_package() did not find [{absent.name}]. {package.name} "
                "compiles nothing, so it is built anyway; its programs may need the missing package"
            )

    def _check_reconfigure_options(self, natives: Sequence[SourcePackage]) -> None:
        """Report compiled packages with `.cfg` files as failed if dynamic_reconfigure is missing.

        Without this check, CMake would fail for all packages.
        """
        users = [native for native in natives if self._result.projects[native.name].has_reconfigure_options]
        if not users or "dynamic_reconfigure" in self._result.projects:
            return
        with suppress(native_tools.MissingTools):  # missing tools are reported by the build itself
            tools = native_tools.find_tools(self._variables)
            if native_tools.has_package(tools, "dynamic_reconfigure", self._variables):
                return
            for package in users:
                target = self._result.projects[package.name].needs_cmake[0]
                self._failures.add_native(
                    package,
                    f"{target.file}:{target.line}: the package [{package.name}] {target.what} and has "
                    "`.cfg` files, but genuine dynamic_reconfigure is not installed. Install it, or put its "
                    "source into the workspace",
                )

    def _settings(self, folder: Path) -> dict[str, str]:
        """Return the CMake variables that depend on the workspace, and those set with `-D`."""
        build = self._layout.build
        binary = build / relative_path(str(folder), str(self._layout.source))
        return {
            "CATKIN_DEVEL_PREFIX": str(self._layout.devel),
            "CATKIN_TEST_RESULTS_DIR": str(build / "test_results"),
            "CMAKE_BINARY_DIR": str(build),
            "CMAKE_COMMAND": cmake_program(build, self._variables),
            "CMAKE_CURRENT_BINARY_DIR": str(binary),
            "CMAKE_INSTALL_PREFIX": str(self._layout.install),
            "CMAKE_SOURCE_DIR": str(self._layout.source),
            **self._options.definitions,
        }

    def _fail(self, package: SourcePackage, reason: str) -> None:
        self._failures.add(package, reason)
        self._state.forget(package.name)

    def _build_package(self, package: SourcePackage, definitions: Definitions) -> None:
        """Build a package without compiled code, or the part of a package that needs no compiler."""
        project = self._result.projects[package.name]
        is_broken = package.name in self._failures.broken
        steps = StepRunner(project.steps, project.binary, self._variables, self._say)
        try:
            steps.run_wanted(item.source for item in project.installations)
            for target in self._options.targets:
                steps.run(target)
            digest = self._state.digest(package, project)
            is_unchanged = self._state.is_current(package.name, digest) and not is_broken
            if not is_unchanged:
                write_devel_files(project, self._layout, definitions, self._say)
        except (PiprosError, OSError) as error:
            self._fail(package, str(error))
            return
        if is_broken:
            self._state.forget(package.name)
        elif is_unchanged and not steps.has_run:
            self._result.unchanged.append(package.name)
        else:
            self._result.built.append(package.name)
            self._state.set(package.name, digest)

    def _build_natives(
        self,
        packages: Sequence[SourcePackage],
        natives: Sequence[SourcePackage],
        names: set[str],
        definitions: Definitions,
    ) -> None:
        """Build packages with compiled code, and their dependencies, with genuine catkin.

        For packages that fail, build the part that needs no compiler.
        """
        natives = [package for package in natives if package.name not in self._failures.failed]
        if not natives:
            return
        chosen = [item for item in packages if item.name in names and item.name not in self._failures.failed]
        is_reason_said, has_catkin_built = True, False
        try:
            failed = self._run_genuine_catkin(chosen)
            has_catkin_built = True
        except native_tools.MissingTools as error:
            is_reason_said = False  # the reason is long, and is printed with the errors
            failed = {package.name: self._why_not_compiled(package, error) for package in natives}
        except NativeBuildFailed as error:
            failed = {package.name: str(error) for package in natives}
        for package in chosen:
            if has_catkin_built and package.name not in failed:
                write_over_genuine(self._result.projects[package.name], self._layout.devel)
                self._result.built.append(package.name)
                self._state.forget(package.name)
                continue  # all others are built without genuine catkin
            if reason := failed.get(package.name):
                self._failures.add_native(package, reason, is_said=is_reason_said)
            elif package.name in failed:
                self._failures.is_broken(package)  # reports the package as skipped
            self._build_package(package, definitions)

    def _run_genuine_catkin(self, packages: Sequence[SourcePackage]) -> dict[str, str]:
        """Return the packages that genuine catkin could not build, with the reasons."""
        tools = native_tools.find_tools(self._variables)
        components = {
            package.name: [name for name, _ in self._result.projects[package.name].components]
            for package in packages
        }
        return genuine_catkin.build(
            tools, packages, self._layout, self._options, self._say, self._variables, components
        )

    def _why_not_compiled(self, package: SourcePackage, error: native_tools.MissingTools) -> str:
        reasons = self._result.projects[package.name].needs_cmake
        target = next((reason for reason in reasons if reason.target), reasons[0])
        text = f"{target.file}:{target.line}: the package [{package.name}] {target.what}, but {error}"
        shipped = shipped_programs(package.name)
        return f"{text}. Until then, these run from pipros: {', '.join(shipped)}" if shipped else text

    def _install(
        self, packages: Sequence[SourcePackage], underlays: Sequence[Path], definitions: Definitions
    ) -> None:
        for package in packages:
            if package.name in self._result.projects and package.name not in self._failures.failed:
                project = self._result.projects[package.name]
                try:
                    settings = self._settings(package.folder)
                    setup = python_setup(project)
                    install_package(project, self._layout, definitions, settings, self._say, setup)
                except (PiprosError, OSError) as error:
                    self._fail(package, f"{project.file}: {error}")
        write_setup_files(self._layout.install, [], underlays)


def _version_of(folder: Path) -> str:
    try:
        return read_manifest(folder).version
    except (XmlError, OSError):
        return ""
