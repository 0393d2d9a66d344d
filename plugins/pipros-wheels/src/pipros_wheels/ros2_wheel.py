"""Build wheels for rclpy with the messages, services and actions of ROS 1 packages."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pipros
from pipros.basics.errors import NotFound
from pipros.basics.plugins import offered
from pipros.msg.importing.hook import installed_library
from pipros.msg.language.definition_files import DefinitionFiles
from pipros.msg.language.definitions import Definitions
from pipros_wheels.archive import ArchiveEntry, write_wheel
from pipros_wheels.names import escaped
from pipros_wheels.ros2_environment import (
    GENERATORS,
    LIBRARIES,
    BuildEnvironment,
    BuildFailed,
    find_compilers,
)
from pipros_workspace.manifest import read_manifest

if TYPE_CHECKING:
    from pipros.basics.printable import Say

ON_PYPI = frozenset(
    (
        *("action_msgs", "actionlib_msgs", "builtin_interfaces", "diagnostic_msgs", "geometry_msgs"),
        *("lifecycle_msgs", "nav_msgs", "rcl_interfaces", "rosgraph_msgs", "sensor_msgs", "service_msgs"),
        *("shape_msgs", "std_msgs", "std_srvs", "stereo_msgs", "test_msgs", "trajectory_msgs"),
        *("type_description_interfaces", "unique_identifier_msgs", "visualization_msgs"),
    )
)
"""The packages of messages that PyPI has for each distribution."""
_RUNTIME = tuple(
    f"rosidl-{name}"
    for name in ("generator-py", "typesupport-c", "typesupport-fastrtps-c", "typesupport-introspection-c")
)


class Ros2Wheels:
    """Builds wheels for a distribution, and those of the packages that they need and that PyPI lacks.

    Args:
        folders: the folders of packages that are not on ROS_PACKAGE_PATH, by name.
    """

    def __init__(
        self,
        distribution: str,
        folders: Mapping[str, Path],
        output: Path,
        say: Say,
    ) -> None:
        translate = offered("ros2_package")
        if translate is None:
            raise BuildFailed("--ros2 needs the gateway to ROS 2, which this installation of pipros lacks")
        find_compilers()
        self._translate: Callable[..., Any] = translate
        installed = installed_library().definitions.files
        self._definitions = Definitions(
            DefinitionFiles(lambda name: folders.get(name) or installed.folder(name))
        )
        self._environment = BuildEnvironment(distribution)
        self._output = output
        self._say = say
        self._files: dict[str, Path] = {}

    def build(self, names: Iterable[str]) -> list[Path]:
        """Build the wheels of packages, and return all that were built.

        Raises:
            PiprosError: a package or a program is missing or invalid, or a program failed.
        """
        with tempfile.TemporaryDirectory(prefix="pipros-ros2-") as folder:
            for name in names:
                self._build(name, Path(folder), ())
        return list(self._files.values())

    def _build(self, name: str, folder: Path, users: tuple[str, ...]) -> None:
        if name in users:
            raise BuildFailed(f"packages need each other: {', '.join(users)}")
        if name in self._files:
            return
        package = self._translate(name, self._environment.distribution, self._definitions)
        for line in package.changes:
            self._say(line)
        for need in sorted(package.needs - ON_PYPI):
            self._build(need, folder, (*users, name))
        self._environment.require((*GENERATORS, *(package.needs & ON_PYPI)))
        prefix, work = folder / "prefix", folder / package.name
        share = prefix / "share" / package.name
        for file, text in package.files.items():
            (share / file).parent.mkdir(parents=True, exist_ok=True)
            (share / file).write_text(text, "utf-8")
        self._environment.generate(package.name, share.parent, work)
        for library in LIBRARIES:
            for file in (work / library).rglob("*.h"):
                target = prefix / "include" / package.name / file.relative_to(work / library)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(file, target)
        self._environment.compile(package.name, work, prefix, package.needs)
        for file in (*(work / "idl").rglob("*.idl"), *(work / LIBRARIES[0]).rglob("*.json")):
            shutil.copy(file, share / file.parent.name)
        code = work / "rosidl_generator_py" / package.name
        self._files[name] = self._write(name, package, code, prefix)

    def _version(self, name: str) -> str:
        """Return the version of a package, or pipros's own if pipros bundles only the definitions."""
        try:
            return read_manifest(Path(self._definitions.files.folder(name))).version
        except NotFound:
            return pipros.__version__

    def _write(self, name: str, package: Any, code: Path, prefix: Path) -> Path:
        distribution, version = self._environment.distribution, self._version(name)
        title = f"ros-{distribution}-{package.name.replace('_', '-')}"
        base = f"{escaped(title)}-{version}"
        tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
        tag = f"{tag}-{tag}-linux_x86_64"
        index = f"{base}.data/data/share/ament_index/resource_index"
        definitions = "\n".join(sorted(package.files))
        manifest = (
            f'<package format="3"><name>{package.name}</name><version>{version}</version>'
            "<description>messages</description><maintainer email='none@example.org'>pipros</maintainer>"
            "<license>as in ROS 1</license><export><build_type>ament_cmake</build_type></export></package>\n"
        )
        needed = [f"ros-{distribution}-{need.replace('_', '-')}" for need in sorted(package.needs)]
        runtime = [f"ros-{distribution}-{each}" for each in _RUNTIME]
        metadata = [
            "Metadata-Version: 2.1",
            f"Name: {title}",
            f"Version: {version}",
            f"Summary: The messages of the ROS 1 package {name}, for rclpy",
            *(f"Requires-Dist: {each}" for each in (*needed, *runtime)),
        ]
        texts = {
            f"{base}.dist-info/METADATA": "\n".join([*metadata, ""]),
            f"{base}.dist-info/WHEEL": f"Wheel-Version: 1.0\nGenerator: pipros {pipros.__version__}\n"
            f"Root-Is-Purelib: false\nTag: {tag}\n",
            f"{index}/packages/{package.name}": "",
            f"{index}/rosidl_interfaces/{package.name}": definitions,
            f"{base}.data/data/share/{package.name}/package.xml": manifest,
            f"{package.name}/__init__.py": "",
        }
        entries = {path: ArchiveEntry(text.encode()) for path, text in texts.items()}
        for file in (*code.rglob("*.py"), *code.glob("*.so")):
            entries[f"{package.name}/{file.relative_to(code)}"] = ArchiveEntry(file)
        for folder in ("include", "share"):
            for file in (prefix / folder / package.name).rglob("*.*"):
                entries[f"{base}.data/data/{file.relative_to(prefix)}"] = ArchiveEntry(file)
        for library in LIBRARIES:
            file = prefix / "lib" / f"lib{package.name}__{library}.so"
            entries[f"{base}.data/data/lib/{file.name}"] = ArchiveEntry(file)
        self._output.mkdir(parents=True, exist_ok=True)
        made = self._output / f"{base}-{tag}.whl"
        write_wheel(made, entries, f"{base}.dist-info")
        return made
