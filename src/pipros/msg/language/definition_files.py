"""Finds the definition files of ROS packages.

It is separate from `definitions.py`, which reads them: a class from the cache needs only this module.
"""

from __future__ import annotations

import os

from pipros.errors import NotFound

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

    FindPackage = Callable[[str], str | os.PathLike[str] | None]

NOUNS = {"msg": "message", "srv": "service", "action": "action"}
ACTION_SUFFIXES = (
    "ActionFeedback",
    "ActionResult",
    "ActionGoal",
    "Action",
    "Feedback",
    "Result",
    "Goal",
)
"""The endings of the names of messages made from an action. Where two fit, the longer one comes first."""


class DefinitionFiles:
    """The definition files of the packages that `find_package` finds."""

    def __init__(self, find_package: FindPackage) -> None:
        self._find_package = find_package

    def file(self, kind: str, type_name: str) -> str:
        """The path of the file that defines a type; `kind` is `msg`, `srv` or `action`.

        Raises:
            NotFound: the package or the file does not exist.
        """
        package, _, name = type_name.partition("/")
        folder = self._folder(package)
        candidates = [os.path.join(folder, kind, f"{name}.{kind}")]
        if kind == "msg":
            candidates += [
                os.path.join(folder, "action", f"{name.removesuffix(suffix)}.action")
                for suffix in ACTION_SUFFIXES
                if name.endswith(suffix)
            ]
        for file in candidates:
            if os.path.isfile(file):
                return file
        raise NotFound(f"there is no {NOUNS[kind]} {name} in package {package}: looked for {candidates[0]}")

    def names(self, kind: str, package: str) -> list[str]:
        """The names of all types of a package, sorted; `kind` is `msg`, `srv` or `action`.

        Raises:
            NotFound: the package does not exist.
        """
        folder = self._folder(package)
        found = set(_stems(os.path.join(folder, kind), f".{kind}"))
        if kind == "msg":
            found.update(
                f"{name}{suffix}"
                for name in _stems(os.path.join(folder, "action"), ".action")
                for suffix in ACTION_SUFFIXES
            )
        return sorted(found)

    def _folder(self, package: str) -> str:
        folder = self._find_package(package)
        if folder is None:
            raise NotFound(f"there is no package {package}: {_where_packages_are()}")
        return os.fspath(folder)


def _where_packages_are() -> str:
    path = os.environ.get("ROS_PACKAGE_PATH")
    searched = f"ROS_PACKAGE_PATH is {path}" if path else "ROS_PACKAGE_PATH is not set"
    return f"{searched}; is the setup.bash of its workspace sourced?"


def _stems(folder: str, extension: str) -> list[str]:
    try:
        return [file[: -len(extension)] for file in os.listdir(folder) if file.endswith(extension)]
    except OSError:
        return []
