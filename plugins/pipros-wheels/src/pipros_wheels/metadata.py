"""Create the `.dist-info` files of a package's wheel from its `package.xml`."""

from __future__ import annotations

import re
from collections.abc import Sequence

import pipros
from pipros_wheels.dependencies import Dependency, DependencySource
from pipros_wheels.names import ON_PYPI, distribution_name, escaped
from pipros_workspace.catkin.project import Project
from pipros_workspace.layout import SourcePackage

TAG = "py3-none-any"
REQUIRES_PYTHON = ">=3.10"

_TAGS = re.compile(r"<[^<>]*>")
_SUMMARY_CHARACTERS = 200


def base_name(package: SourcePackage) -> str:
    """Return the start of the names of a package's wheel and archive, such as `ros1_my_msgs-0.1.0`."""
    return f"{escaped(distribution_name(package.name))}-{package.manifest.version}"


def wheel_text() -> str:
    """Return the contents of the file `WHEEL`."""
    lines = [
        "Wheel-Version: 1.0",
        f"Generator: pipros {pipros.__version__}",
        "Root-Is-Purelib: true",
        f"Tag: {TAG}",
    ]
    return "\n".join([*lines, ""])


def metadata_text(package: SourcePackage, project: Project | None, dependencies: Sequence[Dependency]) -> str:
    """Return the contents of the file `METADATA`. Its body lists the dependencies that pip does not install.

    Args:
        project: the package's parsed `CMakeLists.txt`; None if it was not read.
    """
    manifest = package.manifest
    description = " ".join(_TAGS.sub(" ", manifest.description or "").split())
    _, on_pypi = ON_PYPI.get(package.name, ("", ""))
    wanted = ("pipros", on_pypi, *(item.requirement for item in dependencies))
    requirements = dict.fromkeys(filter(None, wanted))
    people = [_person(person) for person in manifest.maintainers]
    lines = [
        "Metadata-Version: 2.1",
        f"Name: {distribution_name(package.name)}",
        f"Version: {manifest.version}",
        f"Summary: {_summary(description)}",
        f"Maintainer-email: {', '.join(people)}" if people else "",
        f"License: {_line(', '.join(map(str, manifest.licenses)))}",
        "Keywords: ros,ros1",
        *(f"Project-URL: {_line(url.type or 'website')}, {_line(url.url)}" for url in manifest.urls),
        f"Requires-Python: {REQUIRES_PYTHON}",
        *(f"Requires-Dist: {requirement}" for requirement in requirements),
        "Description-Content-Type: text/plain",
    ]
    body = [f"The ROS package {package.name}.", "", description]
    others = [
        item.name
        for item in dependencies
        if item.source in (DependencySource.OTHER, DependencySource.UNKNOWN)
    ]
    if others:
        body += ["", f"Dependencies that pip does not install: {', '.join(others)}"]
    compiled = [reason.target for reason in project.needs_cmake if reason.target] if project else []
    if compiled:
        body += ["", f"Compiled targets that are left out: {', '.join(compiled)}"]
    return "\n".join([*filter(None, lines), "", *body, ""])


def _person(person: object) -> str:
    name, email = (
        _line(str(getattr(person, "name", "") or "")),
        _line(str(getattr(person, "email", "") or "")),
    )
    escaped_name = name.replace("\\", "").replace('"', "")
    return f'"{escaped_name}" <{email}>' if email else name.replace(",", " ")


def _summary(description: str) -> str:
    sentence = description.partition(". ")[0]
    return sentence if len(sentence) <= _SUMMARY_CHARACTERS else sentence[: _SUMMARY_CHARACTERS - 3] + "..."


def _line(text: str) -> str:
    """Join the lines of a text, because headers must be single lines."""
    return " ".join(text.split())
