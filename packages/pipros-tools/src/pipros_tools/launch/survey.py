"""Survey the programs in launch files, and determine who provides each program.

Each file is read separately, without the packages, files and arguments that loading it would require.
`$(arg …)` is substituted if the file gives the argument a value; `if` and `unless` are ignored.
"""

from __future__ import annotations

import csv
import os
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import NamedTuple

from pipros.basics.errors import NotFound, PiprosError
from pipros.basics.input_file import read_file, read_text
from pipros.packages import shipped_folder
from pipros.packages.apt_names import PLUGIN_PACKAGES, PROGRAM_PACKAGES
from pipros.packages.nodelets import package_of, python_nodelet, shipped_nodelets
from pipros.packages.system_packages import PROGRAM_FOLDER, SYSTEM_SHARE
from pipros.safe.xml import Element, XmlError, parse
from pipros_tools.launch.substitute import Substitution, anonymous_name
from pipros_workspace.executables import find_executables
from pipros_workspace.index import SHIPPED_FOLDERS, Package, PackageIndex

COLUMNS = ("file", "in_package", "element", "pkg", "type", "nodelet", "language")
CPP, PYTHON = "cpp", "py"
STARTED = ("node", "test")

_FIND = re.compile(r"\$\(find\s+([\w-]+)\s*\)")


class Owner(Enum):
    """Who provides a program or package."""

    SHIPPED = "shipped"
    WORKSPACE = "workspace"
    DEBIAN = "Debian"
    UNKNOWN = "argument"
    NOT_BUILT = "not built"
    MISSING = "missing"

    @property
    def is_missing(self) -> bool:
        """Whether the program or package is unavailable unless it is built from source."""
        return self in (Owner.NOT_BUILT, Owner.MISSING)


class Use(NamedTuple):
    """A use of a program, a nodelet or a package in a launch file.

    Attributes:
        element: `node`, `test`, `find` (a package in `$(find …)`), or empty for a file without any use.
        nodelet: for a node that runs `nodelet`, the plugin that it loads, or its command, such as `manager`;
            otherwise empty.
        language: `cpp`, `py`, or empty if unknown.
    """

    file: str
    in_package: str
    element: str
    package: str = ""
    program: str = ""
    nodelet: str = ""
    language: str = ""

    @property
    def name(self) -> str:
        """The name to print: `package/program`, or the plugin."""
        return self.nodelet if "/" in self.nodelet else f"{self.package}/{self.program}".rstrip("/")

    @property
    def provider(self) -> str:
        """The package that contains the program or the plugin."""
        return package_of(self.nodelet) if "/" in self.nodelet else self.package


class InvalidSurvey(PiprosError):
    """The CSV file of a survey is malformed."""


def read_csv(path: str) -> list[Use]:
    """Read the uses from a CSV file with the columns of `COLUMNS`.

    Raises:
        InvalidSurvey: the file cannot be read or is malformed.
    """
    try:
        lines = csv.reader(read_text(path).splitlines(), strict=True)
        head = next(lines, [])
        if tuple(head) != COLUMNS:
            raise InvalidSurvey(
                f"[{path}] must start with the line {','.join(COLUMNS)}, got {','.join(head)!r}"
            )
        uses = []
        for row in lines:
            if len(row) != len(COLUMNS):
                raise InvalidSurvey(
                    f"[{path}], line {lines.line_num}: needs {len(COLUMNS)} columns, got {len(row)}"
                )
            uses.append(Use(*row))
    except OSError as error:
        raise InvalidSurvey(f"cannot read [{path}]: {error.strerror or error}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise InvalidSurvey(f"[{path}] is not a CSV file: {error}") from None
    return uses


def read_trees(folders: Collection[str], on_error: Callable[[str], None]) -> list[Use]:
    """Read the launch files below folders: `.launch`, `.test`, and `.xml` files whose root is `<launch>`.

    Args:
        on_error: receives the error of each `.launch` or `.test` file that cannot be read. The file is
            skipped, as are unreadable `.xml` files.

    Raises:
        NotFound: a folder does not exist.
    """
    uses: list[Use] = []
    for top in folders:
        if not os.path.isdir(top):
            raise NotFound(f"[{top}] is not a folder")
        for folder, subfolders, names in os.walk(top):
            subfolders[:] = sorted(name for name in subfolders if not name.startswith("."))
            for name in sorted(names):
                if name.endswith((".launch", ".test", ".xml")):
                    path = os.path.join(folder, name)
                    try:
                        root = parse(read_file(path), path)
                    except (XmlError, OSError) as error:
                        if not name.endswith(".xml"):
                            on_error(str(error))
                        continue
                    if root.tag == "launch":
                        uses += _uses(root, path)
                    elif not name.endswith(".xml"):
                        on_error(f"{path}:{root.line}:{root.column}: no root <launch> tag")
    return uses


def _uses(root: Element, path: str) -> list[Use]:
    owner = PackageIndex(()).containing(Path(path))
    package = owner.name if owner else ""
    values = Substitution(_unknown, os.environ, anonymous_name, folder=os.path.dirname(os.path.abspath(path)))
    found: list[Use] = []
    for element in _descendants(root):
        written = element.attributes
        if element.tag == "arg" and (value := written.get("value", written.get("default"))) is not None:
            values.arguments.setdefault(written.get("name", ""), _resolved(values, value))
        for text in written.values():
            found += (Use(path, package, "find", name) for name in _FIND.findall(text))
        if element.tag in STARTED:
            where, name, words = (_resolved(values, written.get(key, "")) for key in ("pkg", "type", "args"))
            found.append(Use(path, package, element.tag, where, name, _nodelet(where, name, words)))
    return found or [Use(path, package, "")]


def _nodelet(package: str, program: str, arguments: str) -> str:
    if (package, program) != ("nodelet", "nodelet"):
        return ""
    match [word for word in arguments.split() if ":=" not in word]:
        case ["load" | "standalone", plugin, *_]:
            return plugin
        case [command, *_]:
            return command
    return ""


def _descendants(element: Element) -> Iterator[Element]:
    for child in element.children:
        yield child
        yield from _descendants(child)


def _resolved(values: Substitution, text: str) -> str:
    """Return the text with its substitutions applied, or unchanged if one of them fails."""
    try:
        return values.resolve(text)
    except PiprosError:
        return text


def _unknown(package: str, path: str) -> str:
    raise NotFound(f"package [{package}] of [{path}] is not looked up")


class Providers:
    """Determines who provides the programs, plugins and packages in launch files."""

    def __init__(
        self, index: PackageIndex, *, without: Collection[str] = (), others: Collection[str] = ()
    ) -> None:
        """Store the arguments.

        Args:
            without: packages to treat as if pipros did not ship them.
            others: workspace packages that `index` lacks, because they are on another machine. Their Python
                programs count as available, and their C++ programs as not built.
        """
        self._index = index
        self._without = frozenset(without)
        self._others = frozenset(others)
        self._owners: dict[Use, Owner] = {}

    def ships_package(self, name: str) -> bool:
        """Return whether pipros ships a package with this name, even if it lacks some of its programs."""
        return name not in self._without and shipped_folder(name) is not None

    def owner(self, use: Use) -> Owner:
        """Return who provides a program, plugin or package."""
        key = use._replace(file="", in_package="")
        if key not in self._owners:
            self._owners[key] = self._find(key)
        return self._owners[key]

    def _find(self, use: Use) -> Owner:
        if "$(" in use.name:
            return Owner.UNKNOWN
        is_plugin, name = "/" in use.nodelet, use.provider
        if is_plugin and name not in self._without and python_nodelet(use.nodelet):
            return Owner.SHIPPED if use.nodelet in shipped_nodelets() else Owner.WORKSPACE
        package = self._index.get(name)
        is_local = package is not None and _owner(package.path) is Owner.WORKSPACE
        path = _path(package, use) if package else None
        if path is not None and (_owner(path) is not Owner.SHIPPED or name not in self._without):
            return _owner(path)
        if name in self._others:
            return Owner.WORKSPACE if use.language == PYTHON else Owner.NOT_BUILT
        if name in (PROGRAM_PACKAGES if use.program and not is_plugin else PLUGIN_PACKAGES):
            return Owner.DEBIAN
        return Owner.NOT_BUILT if is_local else Owner.MISSING


def _path(package: Package, use: Use) -> Path | None:
    """Return the path of the program, or of the package if no program is named; None if it is not found."""
    if not use.program:
        return package.path
    if "/" in use.nodelet:
        return None
    return next(iter(find_executables(package, use.program).runnable), None)


def _owner(path: Path) -> Owner:
    if any(map(path.is_relative_to, SHIPPED_FOLDERS)):
        return Owner.SHIPPED
    is_systems = any(map(path.is_relative_to, (SYSTEM_SHARE, PROGRAM_FOLDER)))
    return Owner.DEBIAN if is_systems else Owner.WORKSPACE


class Figures(NamedTuple):
    """Counts of launch files with C++ nodes, by how completely pipros replaces these nodes.

    Attributes:
        with_packages: files for which pipros ships the packages of all C++ nodes, complete or not.
        with_programs: files for which pipros ships the programs or nodelets of all C++ nodes.
        lacking: for each package, the number of files that lack programs of this package only.
    """

    with_packages: int
    with_programs: int
    lacking: Counter[str]


def figures(needs: Mapping[str, Sequence[Use]], providers: Providers) -> Figures:
    """Count the files, given the uses of C++ nodes by file."""
    missing = {
        file: {use.provider for use in uses if providers.owner(use) is not Owner.SHIPPED}
        for file, uses in needs.items()
    }
    return Figures(
        sum(all(providers.ships_package(use.package) for use in uses) for uses in needs.values()),
        sum(not names for names in missing.values()),
        Counter(next(iter(names)) for names in missing.values() if len(names) == 1),
    )
