"""Distribution names for ROS packages: `my_msgs` becomes `ros1-my-msgs`."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from functools import cache
from importlib.metadata import Distribution, distributions
from pathlib import Path

from pipros.basics.errors import InvalidName
from pipros.basics.printable import printable

PREFIX = "ros1-"

ON_PYPI = {
    "urdfdom_py": ("urdf_parser_py", "urdf-parser-py>=0.0.4"),
    "xacro": ("xacro", "xacro>=1.13.3"),
}
"""ROS packages whose Python module is also on PyPI, with the module's name and the requirement.

pipros's extras install the module from PyPI. Wheels of these packages do not contain the module but require
the PyPI project, because both would install the same files.
"""

_NAME_CHARACTERS = 200  # short enough for file names with a suffix
_REQUIREMENT_CHARACTERS = 300

_REQUIREMENT = re.compile(
    r"[A-Za-z0-9](?:[\w.-]*[A-Za-z0-9])?(?:\[[\w., -]+\])?"
    r"\s*(?:(?:[<>=!~]=|[<>])\s*[\w.*+!-]+\s*(?:,\s*(?:[<>=!~]=|[<>])\s*[\w.*+!-]+\s*){0,99})?(?:;[^\n\r]*)?",
    re.ASCII,
)
_LEGAL = re.compile(r"[A-Za-z][A-Za-z0-9]*(?:[_.-][A-Za-z0-9]+){0,99}")


def distribution_name(package: str) -> str:
    """Return the distribution name for a ROS package.

    Raises:
        InvalidName: the package name cannot be converted to a distribution name.
    """
    if len(package) > _NAME_CHARACTERS or not _LEGAL.fullmatch(package):
        raise InvalidName(
            f"package name [{printable(package)}] must consist of letters and digits, separated by single "
            f"underscores, dashes or dots, begin with a letter, and be at most {_NAME_CHARACTERS} characters "
            "long; rename the package in package.xml"
        )
    return PREFIX + normalized(package)


def normalized(name: str) -> str:
    """Normalize a distribution's name as specified in PEP 503."""
    return re.sub(r"[-_.]+", "-", name).lower()


def escaped(distribution: str) -> str:
    """Return a distribution's name in the form that file names of wheels require."""
    return normalized(distribution).replace("-", "_")


def is_requirement(text: str) -> bool:
    """Return whether a text is a requirement, such as `pyserial>=3.5`."""
    return len(text) <= _REQUIREMENT_CHARACTERS and _REQUIREMENT.fullmatch(text) is not None


@cache
def own_modules() -> frozenset[str]:
    """Return the top-level modules that pipros itself installs, and that wheels must not overwrite.

    These are all but its packages of messages, which have an `__init__.pyi`: a wheel may replace them. They
    are searched for once in a process, because that reads the metadata of all distributions.
    """
    installed = [
        parts
        for each in distributions()
        if normalized(each.name) == "pipros" or normalized(each.name).startswith("pipros-")
        for parts in _parts_of_files(each)
    ]
    messages = {parts[0] for parts in installed if parts[1:] == ("__init__.pyi",)}
    return frozenset(parts[0].removesuffix(".py") for parts in installed) - messages


_SOURCES = ("src", "facades")


def _parts_of_files(distribution: Distribution) -> Iterator[tuple[str, ...]]:
    """Yield the parts of each file's path, in site-packages or in the folders of an editable one."""
    for file in distribution.files or ():
        yield file.parts
        if file.suffix == ".pth":
            for folder in filter(os.path.isdir, file.read_text().splitlines()):
                for entry in Path(folder).iterdir() if folder.endswith(_SOURCES) else ():
                    yield (entry.name,)
                    if (entry / "__init__.pyi").is_file():
                        yield (entry.name, "__init__.pyi")
