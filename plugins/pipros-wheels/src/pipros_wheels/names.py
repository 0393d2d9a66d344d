"""Distribution names for ROS packages: `my_msgs` becomes `ros1-my-msgs`."""

from __future__ import annotations

import re
from pathlib import Path

import pipros
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
    r"\s*(?:(?:[<>=!~]=|[<>])\s*[\w.*+!-]+\s*(?:,\s*(?:[<>=!~]=|[<>])\s*[\w.*+!-]+\s*)*)?(?:;[^\n\r]*)?",
    re.ASCII,
)
_LEGAL = re.compile(r"[A-Za-z][A-Za-z0-9]*(?:[_.-][A-Za-z0-9]+)*")


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


def own_modules() -> frozenset[str]:
    """Return the top-level modules that pipros itself installs. Wheels must not overwrite them."""
    # In a source tree, `pipros` is imported from links in `build`; see script/merge_packages.py.
    build = Path(pipros.__file__).absolute().parents[2]
    facades = [folder for name in ("facades", "internals") if (folder := build / name).is_dir()]
    if facades:
        found = [entry for folder in facades for entry in folder.iterdir()]
        return frozenset(("pipros", *(entry.stem for entry in found if not entry.name.startswith("_"))))
    from importlib.metadata import files

    return frozenset(file.parts[0].removesuffix(".py") for file in files("pipros") or ())
