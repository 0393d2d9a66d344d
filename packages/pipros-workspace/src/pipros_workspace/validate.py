"""Check a package for errors that catkin would report, before building anything."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.msg.language.definitions import Definitions
from pipros.msg.language.spec import MessageSpec
from pipros.safe.xml import XmlError
from pipros_workspace.catkin.project import Interface, Project
from pipros_workspace.cmake.language import CMakeError
from pipros_workspace.layout import SourcePackage
from pipros_workspace.manifest import read_manifest

MESSAGES_WITHOUT_DEPENDENCY = frozenset(("std_msgs", "actionlib_msgs"))
"""Packages that need not be listed as dependencies, because `Header` and actions use them."""


def check_manifest(project: Project, package: SourcePackage) -> None:
    """Check the `CMakeLists.txt` against the manifest.

    Raises:
        CMakeError: the manifest lacks a run dependency that `catkin_package()` lists.
    """
    run = package.dependencies("exec_depends", "build_export_depends")
    for name, line in project.catkin_depends:
        if name not in run:
            raise CMakeError(
                project.file,
                line,
                "catkin_package",
                f"catkin_package() DEPENDS on the catkin package '{name}' which must therefore be listed as "
                f"a run dependency in the package.xml\n  Add <exec_depend>{name}</exec_depend> to "
                f"{package.manifest_file}",
            )


def check_interfaces(
    project: Project,
    definitions: Definitions,
    find_folder: Callable[[str], Path | None],
    *,
    allows_absent: bool = False,
) -> None:
    """Check every message, service and action of a package, including embedded messages.

    Args:
        find_folder: function that returns a package's folder, or None if the package does not exist.
        allows_absent: whether packages that `generate_messages(DEPENDENCIES …)` lists may be missing, as in
            the environment in which pip builds one package. Their types are then not checked.

    Raises:
        DefinitionError: a file is malformed; the error text names the file, line and column.
        UndefinedType: a field has a type that does not exist.
        CMakeError: a field has a type from a package that `generate_messages(DEPENDENCIES …)` does not list.
    """
    allowed = {project.name, *MESSAGES_WITHOUT_DEPENDENCY}
    allowed |= _with_dependencies(project.message_dependencies, find_folder)
    for interface in project.interfaces:
        for spec in specs_of(interface, project.name, definitions):
            for field in spec.fields:
                if field.type.is_builtin:
                    continue
                package = field.type.base.partition("/")[0]
                if package not in allowed:
                    raise CMakeError(
                        project.file,
                        project.generate_messages_line,
                        "generate_messages",
                        f"Could not find messages which '{interface.path}' depends on (line {field.line}: "
                        f"{field.type}). Did you forget to specify "
                        f"generate_messages(DEPENDENCIES {package})?",
                    )
                if not (allows_absent and package != project.name and find_folder(package) is None):
                    _check_type(field.type.base, spec, field.line, definitions)


def _with_dependencies(names: Sequence[str], find_folder: Callable[[str], Path | None]) -> set[str]:
    """Return the given packages and all their direct and indirect run dependencies.

    Definitions may use messages from all of them.
    """
    known: set[str] = set()
    pending = list(names)
    while pending:
        name = pending.pop()
        folder = None if name in known else find_folder(name)
        known.add(name)
        if folder is not None:
            with suppress(XmlError, OSError):
                pending += read_manifest(folder).depends("build_export_depends", "exec_depends")
    return known


def _check_type(type_name: str, within: MessageSpec, line: int, definitions: Definitions) -> None:
    try:
        definitions.message(type_name)
    except LookupError:
        raise UndefinedType(f"{within.file}:{line}: there is no message type [{type_name}]") from None


class UndefinedType(PiprosError):
    """A field has a type that no package defines."""


def specs_of(interface: Interface, package: str, definitions: Definitions) -> Iterator[MessageSpec]:
    """Yield the messages defined by an interface file."""
    type_name = f"{package}/{interface.name}"
    if interface.kind == "msg":
        yield definitions.message(type_name)
    elif interface.kind == "srv":
        service = definitions.service(type_name)
        yield from (service.request, service.response)
    else:
        for part in ("Goal", "Result", "Feedback"):
            yield definitions.message(type_name + part)
