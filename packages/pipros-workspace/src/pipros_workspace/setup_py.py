"""Read a package's `setup.py`: its Python packages, their folders, and its scripts.

As in catkin, a separate interpreter runs the file, and `setup()` only records its arguments. If setuptools is
not installed, substitutes for `setuptools` and `distutils` have `setup()` and `find_packages()` only.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pipros.basics.env import DISTRIBUTION
from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.windows import check_working_folder

_TIME_LIMIT_S = 60.0

_PROBE = """
import fnmatch, json, os, runpy, sys, types
recorded = {}
def setup(**arguments):
    recorded.clear()
    recorded.update(arguments)
def find_packages(where=".", exclude=(), include=("*",)):
    found = []
    for folder, below, files in os.walk(where):
        if folder == where or "__init__.py" in files:
            name = os.path.relpath(folder, where).replace(os.sep, ".")
            if (folder != where and any(fnmatch.fnmatchcase(name, item) for item in include)
                    and not any(fnmatch.fnmatchcase(name, item) for item in exclude)):
                found.append(name)
        else:
            del below[:]
    return found
try:
    import setuptools, distutils.core
    setuptools.setup = distutils.core.setup = setup
except ImportError:
    for name in ("distutils", "distutils.core", "setuptools"):
        module = types.ModuleType(name)
        module.setup, module.find_packages = setup, find_packages
        module.__path__ = []
        sys.modules[name] = module
    sys.modules["distutils"].core = sys.modules["distutils.core"]
sys.argv = ["setup.py", "--version"]
sys.path.insert(0, ".")
try:
    runpy.run_path("setup.py", run_name="__main__")
except SystemExit as end:
    if end.code:
        raise
def plain(value):
    return os.fspath(value) if isinstance(value, os.PathLike) else list(value)
names = ("packages", "package_dir", "scripts", "py_modules", "data_files", "entry_points")
found = {key: recorded.get(key) for key in names}
print("\\0" + json.dumps(found, default=plain))
"""


class SetupPyError(PiprosError):
    """A `setup.py` failed or took too long."""


_CONFIGURATIONS = ("setup.cfg", "pyproject.toml")
_PACKAGES_ELSEWHERE = re.compile(
    r"^[ \t]*(packages|py[-_]modules|scripts)\s*=|^\[tool\.setuptools\.packages", re.MULTILINE
)
_PROGRAM_GROUPS = ("console_scripts", "gui_scripts")
_ENTRY_POINT = re.compile(r"\s*([\w.-]+)\s*=\s*([\w.]+:[\w.]+)\s*(?:\[.*)?")


@dataclass(frozen=True, slots=True)
class PythonSetup:
    """The arguments of `setup()`. All paths are absolute.

    Attributes:
        packages: the folder of each package.
        modules: the file of each module that is not in a package.
        data_files: pairs of a folder below the install space and a file to install there.
        entry_points: the function of each program in `console_scripts` and `gui_scripts`, such as
            `arm.cli:main`.
        left_out: a line for each entry point that no program can be made of.
    """

    packages: Mapping[str, str]
    scripts: Sequence[str]
    modules: Mapping[str, str] = field(default_factory=dict)
    data_files: Sequence[tuple[str, str]] = ()
    entry_points: Mapping[str, str] = field(default_factory=dict)
    left_out: Sequence[str] = ()

    @property
    def files(self) -> list[str]:
        """The folders of the packages, and all files."""
        return [
            *self.packages.values(),
            *self.scripts,
            *self.modules.values(),
            *(path for _, path in self.data_files),
        ]


def read_setup_py(folder: str, *, limit_s: float = _TIME_LIMIT_S) -> PythonSetup:
    """Run the `setup.py` in a folder; `ROS_DISTRO` and similar variables default to Noetic's values.

    Raises:
        SetupPyError: the file failed or exceeded the time limit. After a failure, the message includes the
            last lines of the error output.
    """
    recorded = _recorded(folder, limit_s)
    _check_elsewhere(folder, recorded)
    package_names, module_names = (recorded.get(key) or [] for key in ("packages", "py_modules"))
    for name in (*package_names, *module_names):
        _check_inside(folder, name)
    folders = recorded.get("package_dir") or {}

    def path_of(name: str) -> str:
        return os.path.normpath(os.path.join(folder, _folder_of(name, folders)))

    packages = {name: path_of(name) for name in package_names}
    _check_parents(folder, packages)
    lone_modules = (
        name
        for name in module_names
        if not any(name == package or name.startswith(f"{package}.") for package in packages)
    )
    return PythonSetup(
        packages,
        [os.path.join(folder, script) for script in recorded.get("scripts") or []],
        {name: f"{path_of(name)}.py" for name in lone_modules},
        list(_data_files(folder, recorded.get("data_files") or [])),
        *_entry_points(recorded.get("entry_points")),
    )


def _recorded(folder: str, limit_s: float) -> dict[str, Any]:
    """Run a `setup.py`, and return the arguments that it passes to `setup()`."""
    try:
        check_working_folder(folder)
        ended = subprocess.run(  # noqa: S603
            [sys.executable, "-c", _PROBE],
            cwd=folder,
            env={**DISTRIBUTION, **os.environ},
            capture_output=True,
            text=True,
            timeout=limit_s,
            check=False,
        )
    except OSError as error:
        raise SetupPyError(f"{folder}/setup.py was not run: {error.strerror}") from None
    except subprocess.TimeoutExpired:
        raise SetupPyError(f"{folder}/setup.py did not finish within {limit_s:.0f} s") from None
    if ended.returncode != 0 or "\0" not in ended.stdout:
        last_lines = ended.stderr.strip().splitlines()[-3:]
        reason = "\n  ".join(last_lines) or f"it ended with exit status {ended.returncode}"
        raise SetupPyError(f"{folder}/setup.py failed:\n  {reason}")
    recorded: dict[str, Any] = json.loads(ended.stdout.rpartition("\0")[2])
    return recorded


def _check_inside(folder: str, name: str) -> None:
    """Refuse a name whose file would be outside of the folder of all modules."""
    below = os.path.normpath(os.path.join(*name.split(".")))
    if os.path.isabs(below) or below.split(os.sep)[0] == os.pardir:
        raise SetupPyError(
            f"{folder}/setup.py: the name of a package or module must not lead out of the folder of all "
            f"modules, got {name!r}"
        )


def _data_files(folder: str, declared: Sequence[Any]) -> Iterator[tuple[str, str]]:
    """Yield the target folder and the path of each file. As in setuptools, a lone file has no target."""
    for each in declared:
        target, files = ("", [each]) if isinstance(each, str) else each
        for file in files:
            yield target, os.path.join(folder, file)


def _entry_points(declared: object) -> tuple[dict[str, str], list[str]]:
    """Return the function of each program, and a line for each other entry point."""
    programs: dict[str, str] = {}
    left_out = []
    for group, line in _grouped(declared):
        match = _ENTRY_POINT.fullmatch(line)
        if group not in _PROGRAM_GROUPS:
            left_out.append(f"setup.py: the entry point [{line}] is left out, because it is in [{group}]")
        elif match is None:
            left_out.append(
                f"setup.py: the entry point [{line}] is left out; it must be NAME = MODULE:FUNCTION"
            )
        else:
            programs[match[1]] = match[2]
    return programs, left_out


def _grouped(declared: object) -> Iterator[tuple[str, str]]:
    """Return the group and text of each entry point.

    As in setuptools, they can be a text with the groups as headings; in a dictionary, the value of a group is
    a list, or a text with several lines.
    """
    groups: dict[str, Any] = declared if isinstance(declared, dict) else {"": declared}
    for name, value in groups.items():
        group = name
        for text in [value] if isinstance(value, str) else value or ():
            for line in map(str.strip, str(text).splitlines()):
                if line.startswith("[") and line.endswith("]"):
                    group = line[1:-1].strip()
                elif line and not line.startswith("#"):
                    yield group.strip(), line


def _check_elsewhere(folder: str, recorded: Mapping[str, Any]) -> None:
    """Refuse a `setup.py` whose packages are in another file, which genuine catkin does not read either."""
    if any(recorded.get(name) for name in ("packages", "py_modules", "scripts")):
        return
    for name in _CONFIGURATIONS:
        try:
            text = read_text(os.path.join(folder, name), errors="replace")
        except OSError:
            continue
        if _PACKAGES_ELSEWHERE.search(text):
            raise SetupPyError(
                f"{folder}/setup.py passes no packages to setup(), and catkin does not read {name}; pass "
                "them in setup.py, with generate_distutils_setup()"
            )


def _check_parents(folder: str, packages: Mapping[str, str]) -> None:
    """Refuse a subpackage outside of its parent's folder, as genuine catkin does."""
    for name, path in packages.items():
        top, *below = name.split(".")
        if top in packages and below and below[0] not in ("msg", "srv"):
            expected = os.path.join(packages[top], *below)
            if path != expected:
                raise SetupPyError(
                    f"{folder}/setup.py: package_dir has {name} in {path}, but catkin finds a subpackage "
                    f"only inside of its parent: {expected}"
                )


def _folder_of(package: str, folders: Mapping[str, str]) -> str:
    """Return the folder of a Python package according to `package_dir`, as setuptools computes it."""
    parts, below = package.split("."), list[str]()
    while parts:
        known = folders.get(".".join(parts))
        if known is not None:
            return os.path.join(known, *below)
        below.insert(0, parts.pop())
    return os.path.join(folders.get("", ""), *below)
