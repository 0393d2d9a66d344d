"""What a package's `CMakeLists.txt` asks for, as plain values; `workspace.project_reader` reads it."""

from __future__ import annotations

from dataclasses import dataclass, field

from pipros.workspace.custom import Steps
from pipros.workspace.installation import Installation

PYTHON_DESTINATION = "lib/python3/dist-packages"


@dataclass(frozen=True, slots=True)
class Interface:
    """A message, service or action file; `kind` is msg, srv or action."""

    kind: str
    name: str
    path: str


@dataclass(frozen=True, slots=True)
class NativeTarget:
    """Something that only the real CMake can do; `what` says it behind `the package [x]`."""

    what: str
    file: str
    line: int


@dataclass(frozen=True, slots=True)
class TestEntry:
    """A test that `run_tests` runs.

    Attributes:
        kind: `rostest` for a launch file with tests, `roslaunch` for a launch file or folder to be checked,
            `python` for a file or folder of unit tests, `gtest` for a compiled program.
        path: the file; the name of the program for `gtest`.
        arguments: of the launch file; options and variables for a check.
        written: the path as the `CMakeLists.txt` has it, from the package's folder on.
        target: what has to be compiled before.
        time_limit_s: for unit tests.
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
    """A file that tests need from elsewhere: `path` is where to put it."""

    url: str
    path: str
    md5: str = ""


@dataclass(frozen=True, slots=True)
class EnvironmentHook:
    """A file that the setup files of the workspace carry out; `text` is None for one that is copied."""

    name: str
    source: str
    text: str | None = None


@dataclass(slots=True)
class Project:
    """A package as its `CMakeLists.txt` has it.

    Attributes:
        remarks: what `message(STATUS)` and its like said.
        notes: what the builder warns about.
        extras: CMake files for packages that find this one.
        targets: the names of what can be made one by one.
    """

    name: str
    folder: str
    file: str
    binary: str = ""
    components: list[tuple[str, int]] = field(default_factory=list)
    interfaces: list[Interface] = field(default_factory=list)
    generate_messages_line: int = 0
    message_dependencies: list[str] = field(default_factory=list)
    catkin_depends: list[tuple[str, int]] = field(default_factory=list)
    has_catkin_package: bool = False
    has_python_setup: bool = False
    installations: list[Installation] = field(default_factory=list)
    native_targets: list[NativeTarget] = field(default_factory=list)
    steps: Steps = field(default_factory=Steps)
    hooks: list[EnvironmentHook] = field(default_factory=list)
    tests: list[TestEntry] = field(default_factory=list)
    downloads: list[Download] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    extras: list[str] = field(default_factory=list)
    targets: set[str] = field(default_factory=set)
