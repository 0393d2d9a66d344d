"""What the `CMakeLists.txt` of a package describes, as values. `project_reader.py` reads it."""

from __future__ import annotations

from dataclasses import dataclass, field

from pipros.workspace.catkin.installation import Installation
from pipros.workspace.catkin.steps import Steps

PYTHON_DESTINATION = "lib/python3/dist-packages"


@dataclass(frozen=True, slots=True)
class Interface:
    """A message, service or action file.

    Attributes:
        kind: `msg`, `srv` or `action`.
        folder: where to install it, below the share folder of the package; None if it is not installed.
    """

    kind: str
    name: str
    path: str
    folder: str | None = None


@dataclass(frozen=True, slots=True)
class NativeTarget:
    """Something that only genuine catkin and CMake can build; `what` completes "the package [x] …"."""

    what: str
    file: str
    line: int


@dataclass(frozen=True, slots=True)
class TestEntry:
    """A test that `run_tests` runs.

    Attributes:
        kind: `rostest` for a launch file with tests, `roslaunch` for a launch file or folder to check,
            `python` for a file or folder of unit tests, `gtest` for a compiled program.
        path: the file or folder; for `gtest` the name of the program.
        arguments: for the launch file; for a check, options and arguments.
        written: the path as in the `CMakeLists.txt`, relative to the package's folder.
        target: the target to compile before.
        place: file and line, for messages.
    """

    kind: str
    path: str
    arguments: tuple[str, ...] = ()
    written: str = ""
    target: str = ""
    place: str = ""


@dataclass(frozen=True, slots=True)
class Download:
    """A file that tests need from the network; `path` is where to store it."""

    url: str
    path: str
    md5: str = ""


@dataclass(frozen=True, slots=True)
class EnvironmentHook:
    """A file that the setup files of a workspace run.

    Attributes:
        text: its content; None for that of `source`.
        installed: its content in the install space; None if that is the same.
    """

    name: str
    source: str
    text: str | None = None
    installed: str | None = None


@dataclass(slots=True)
class Project:
    """A package as its `CMakeLists.txt` describes it.

    Attributes:
        folder, file: the package's folder, and its `CMakeLists.txt`.
        binary: its folder in the build space.
        components, catkin_depends: names of packages with the lines that name them.
        generate_messages_line: the line of `generate_messages()`, 0 without one.
        has_reconfigure_options: whether `generate_dynamic_reconfigure_options()` was called.
        config_files: the `.cfg` files of dynamic_reconfigure, relative to the package's folder.
        needs_cmake: why genuine catkin has to build the package; empty if pipros can.
        status_lines: what `message(STATUS)` and the like print.
        warnings: what to warn about, with file and line.
        cfg_extras: CMake files for the packages that find this one.
        targets: the names of targets that can be made one by one.
    """

    name: str
    folder: str
    file: str
    binary: str = ""
    components: list[tuple[str, int]] = field(default_factory=list)
    interfaces: list[Interface] = field(default_factory=list)
    generate_messages_line: int = 0
    message_dependencies: list[str] = field(default_factory=list)
    has_reconfigure_options: bool = False
    config_files: list[str] = field(default_factory=list)
    catkin_depends: list[tuple[str, int]] = field(default_factory=list)
    has_catkin_package: bool = False
    has_python_setup: bool = False
    installations: list[Installation] = field(default_factory=list)
    needs_cmake: list[NativeTarget] = field(default_factory=list)
    steps: Steps = field(default_factory=Steps)
    hooks: list[EnvironmentHook] = field(default_factory=list)
    tests: list[TestEntry] = field(default_factory=list)
    downloads: list[Download] = field(default_factory=list)
    status_lines: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    cfg_extras: list[str] = field(default_factory=list)
    targets: set[str] = field(default_factory=set)
