"""Build a catkin workspace: check each package, write its devel files, and install it if requested.

Packages with only Python, messages, launch files and data need neither CMake nor a compiler. Packages with
compiled code are built by genuine catkin and CMake (`genuine_catkin.py`) if these are installed. If a package
fails, packages that depend on it are skipped, and all others are built. If only the compiled part of a
package fails, its messages and Python code are built, and only the compiled parts of packages that depend on
it are skipped.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import pipros
from pipros.basics.errors import NotFound, PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.windows import relative_path
from pipros.msg.language.definition_files import DefinitionFiles
from pipros.msg.language.definitions import Definitions
from pipros.msg.language.spec import DefinitionError
from pipros.msg.stubs import write_stubs
from pipros.safe.xml import XmlError
from pipros_workspace import genuine_catkin, native_tools
from pipros_workspace.build_options import BuildOptions
from pipros_workspace.catkin.cmake_shim import cmake_program
from pipros_workspace.catkin.context import FindPackage, FoundPackage
from pipros_workspace.catkin.project import NativeTarget, Project, installed_extras
from pipros_workspace.catkin.project_reader import read_project
from pipros_workspace.catkin.step_runner import StepRunner
from pipros_workspace.cmake_runs import NativeBuildFailed
from pipros_workspace.devel import (
    install_package,
    python_setup,
    python_sources,
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
from pipros_workspace.setup_files import write_if_changed, write_setup_files
from pipros_workspace.validate import check_interfaces, check_manifest

if TYPE_CHECKING:
    from pipros.basics.printable import Say


@dataclass(slots=True)
class BuildResult:
    """The outcome of a build.

    Attributes:
        built: names of the packages that were built, in build order.
        unchanged: names of packages that were up to date.
        errors: one error text per problem, starting with the package or file.
        skipped: packages that were skipped, each mapped to the failed package on which it depends. If such a
            package has compiled code, its other parts may have been built.
        projects: the parsed `CMakeLists.txt` of each package, by package name.
        needs_genuine: packages that only genuine catkin can build, except those in `BuildOptions.genuine`. If
            there are any, nothing was built. Only set with `BuildOptions.is_alone`.
    """

    built: list[str] = field(default_factory=list)
    unchanged: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    skipped: dict[str, str] = field(default_factory=dict)
    projects: dict[str, Project] = field(default_factory=dict)
    needs_genuine: list[str] = field(default_factory=list)


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
        self._failed: dict[str, str] = {}
        self._broken: dict[str, str] = {}  # causes of failed compiled parts, by package
        self._state_file = layout.build / "pipros" / "state.json"
        self._state = _read_state(self._state_file)

    def run(self) -> BuildResult:
        space = read_source_space(self._layout.source, self._variables)
        self._result.errors += space.errors
        self._failed.update({name: name for name in space.left_out})
        packages = self._wanted(space.packages)
        self._announce(packages)
        by_name = {package.name: package for package in space.packages}
        index = PackageIndex.from_environment()

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
                return FoundPackage(_version_of(folder), installed_extras(folder))
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
        natives = [package for package in natives if not self._is_broken(package)]
        native_names = {package.name for package in natives}
        if natives and native_tools.has_tools(self._variables):
            native_names = closure(packages, native_names)
        for package in packages:
            if package.name not in self._result.projects or self._is_blocked(package):
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
        write_if_changed(self._state_file, json.dumps(self._state, indent=1, sort_keys=True))

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
        if package.build_type.startswith("ament"):
            self._fail(
                package,
                f"{package.manifest_file}: the package is for ROS 2 (build type {package.build_type}). Check "
                "out its branch for ROS 1, or put a file named CATKIN_IGNORE into its folder",
            )
            return None
        if not os.path.lexists(package.folder / "CMakeLists.txt"):
            self._fail(package, f"{package.folder}: the package has no CMakeLists.txt")
            return None
        self._say(f"-- ==> add_subdirectory({relative_path(str(package.folder), str(self._layout.source))})")
        status_lines: list[str] = []
        try:
            project = read_project(
                str(package.folder),
                package.name,
                self._settings(package),
                self._variables,
                find_for_cmake,
                str(package.manifest.version),
                status_lines=status_lines,
            )
            check_manifest(project, package)
            check_interfaces(project, definitions, find_folder)
        except PiprosError as error:
            for line in status_lines:
                self._say(line)
            self._fail(package, str(error))
            return None
        counts = {
            kind: sum(interface.kind == kind for interface in project.interfaces)
            for kind in ("msg", "srv", "action")
        }
        if project.interfaces:
            self._say("-- Using these message generators: genpy")
            messages = counts["msg"] + 7 * counts["action"]
            self._say(f"-- {package.name}: {messages} messages, {counts['srv']} services")
            if not project.generate_messages_line:
                self._say(
                    f"-- WARNING: {package.name} lists message files but never calls generate_messages()"
                )
        for line in project.status_lines:
            self._say(line)
        for warning in project.warnings:
            self._say(f"-- WARNING: {warning}")
        return project

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
            self._fail_native(package, project.absent[0].error)
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
                self._fail_native(
                    package,
                    f"{target.file}:{target.line}: the package [{package.name}] {target.what} and has "
                    "`.cfg` files, but genuine dynamic_reconfigure is not installed. Install it, or put its "
                    "source into the workspace",
                )

    def _settings(self, package: SourcePackage) -> dict[str, str]:
        """Return the CMake variables that depend on the workspace, and those set with `-D`."""
        build = self._layout.build
        binary = build / relative_path(str(package.folder), str(self._layout.source))
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

    def _fail(self, package: SourcePackage, reason: str, *, is_said: bool = True) -> None:
        if is_said:
            self._say(reason)
        self._failed[package.name] = package.name
        self._result.errors.append(f"{package.name}: {reason}")
        self._state.pop(package.name, None)

    def _fail_native(self, package: SourcePackage, reason: str, *, is_said: bool = True) -> None:
        """Report that the compiled part of a package cannot be built. Its other parts are not affected."""
        if is_said:
            self._say(reason)
        self._broken[package.name] = package.name
        self._result.errors.append(f"{package.name}: {reason}")

    def _is_broken(self, package: SourcePackage) -> bool:
        """Return whether the compiled part of the package, or of one of its dependencies, failed.

        If a dependency failed, report the package as skipped.
        """
        if package.name in self._broken:
            return True
        needed = (name for name in sorted(package.all_dependencies) if name in self._broken)
        culprit = self._broken.get(next(needed, ""))
        if culprit is None:
            return False
        self._broken[package.name] = self._result.skipped[package.name] = culprit
        self._say(f"-- {package.name} is not compiled, because it needs {culprit}, which failed")
        return True

    def _is_blocked(self, package: SourcePackage) -> bool:
        """Return whether a dependency of the package failed. If so, report the package as skipped."""
        for name in sorted(package.all_dependencies):
            culprit = self._failed.get(name)
            if culprit is not None:
                self._failed[package.name] = culprit
                self._result.skipped[package.name] = culprit
                self._say(f"-- {package.name} is skipped, because it needs {culprit}, which failed")
                return True
        return False

    def _build_package(self, package: SourcePackage, definitions: Definitions) -> None:
        """Build a package without compiled code, or the part of a package that needs no compiler."""
        project = self._result.projects[package.name]
        is_broken = package.name in self._broken
        steps = StepRunner(project.steps, project.binary, self._variables, self._say)
        try:
            steps.run_wanted(item.source for item in project.installations)
            for target in self._options.targets:
                steps.run(target)
            digest = self._digest(package, project)
            is_unchanged = self._state.get(package.name) == digest and not is_broken
            if not is_unchanged:
                write_devel_files(project, self._layout, definitions, self._say)
        except (PiprosError, OSError) as error:
            self._fail(package, str(error))
            return
        if is_broken:
            self._state.pop(package.name, None)
        elif is_unchanged and not steps.has_run:
            self._result.unchanged.append(package.name)
        else:
            self._result.built.append(package.name)
            self._state[package.name] = digest

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
        natives = [package for package in natives if package.name not in self._failed]
        if not natives:
            return
        chosen = [item for item in packages if item.name in names and item.name not in self._failed]
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
                self._state.pop(package.name, None)
                continue  # all others are built without genuine catkin
            if reason := failed.get(package.name):
                self._fail_native(package, reason, is_said=is_reason_said)
            elif package.name in failed:
                self._is_broken(package)  # reports the package as skipped
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
            if package.name in self._result.projects and package.name not in self._failed:
                project = self._result.projects[package.name]
                try:
                    settings = self._settings(package)
                    setup = python_setup(project)
                    install_package(project, self._layout, definitions, settings, self._say, setup)
                except (PiprosError, OSError) as error:
                    self._fail(package, f"{project.file}: {error}")
        write_setup_files(self._layout.install, [], underlays)

    def _digest(self, package: SourcePackage, project: Project) -> str:
        """Return a digest of all inputs of the package's devel files."""
        inputs = [
            str(package.manifest_file),
            project.file,
            *(interface.path for interface in project.interfaces),
            *(os.path.join(project.folder, file) for file in project.config_files),
        ]
        inputs += [item.source for item in project.installations if item.is_python]
        inputs += [hook.source for hook in project.hooks]
        inputs += python_sources(project)
        texts = [hook.text for hook in project.hooks]
        digest = hashlib.sha256(f"{pipros.__file__} {self._layout} {texts}".encode())
        for path in inputs:
            try:
                status = os.stat(path)
                digest.update(f"{path}\0{status.st_mtime_ns}\0{status.st_size}\0{status.st_mode}\n".encode())
            except OSError:
                digest.update(f"{path}\0gone\n".encode())
        return digest.hexdigest()


def _version_of(folder: Path) -> str:
    try:
        return read_manifest(folder).version
    except (XmlError, OSError):
        return ""


def _read_state(file: Path) -> dict[str, str]:
    try:
        state = json.loads(read_text(file))
    except (OSError, ValueError, RecursionError):
        return {}
    return {str(name): str(digest) for name, digest in state.items()} if isinstance(state, dict) else {}
