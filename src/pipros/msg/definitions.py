"""The definition files of ROS packages: which there are, and what they say."""

from __future__ import annotations

import os
from collections.abc import Callable

from pipros.errors import NotFound
from pipros.msg.parse import parse_action, parse_message, parse_service
from pipros.msg.spec import DefinitionError, MessageSpec, ServiceSpec

FindPackage = Callable[[str], "str | os.PathLike[str] | None"]

ACTION_SUFFIXES = (
    "ActionFeedback",
    "ActionResult",
    "ActionGoal",
    "Action",
    "Feedback",
    "Result",
    "Goal",
)
"""What the names of the messages made from an action end with; the longest that fits decides."""

FILE_LIMIT_BYTES = 4 * 1024 * 1024
"""No definition is longer; a file that is was not meant as one."""


class Definitions:
    """Reads the definitions of the packages that `find_package` finds.

    Each file is read once. An unknown package or type is a `NotFound`.
    """

    def __init__(self, find_package: FindPackage) -> None:
        self._find_package = find_package
        self._messages: dict[str, MessageSpec] = {}
        self._services: dict[str, ServiceSpec] = {}

    def message(self, type_name: str) -> MessageSpec:
        """The definition of `package/Name`, from a `.msg` file or from the `.action` file behind it.

        Raises:
            NotFound: there is no such package or file.
            DefinitionError: the file breaks the rules.
        """
        if type_name not in self._messages:
            file = self.file("msg", type_name)
            if file.endswith(".action"):
                action_type = type_name.partition("/")[0] + "/" + _stem(file)
                for spec in parse_action(_read(file), action_type, file).messages:
                    self._messages.setdefault(spec.type, spec)
            else:
                self._messages[type_name] = parse_message(_read(file), type_name, file)
        return self._messages[type_name]

    def service(self, type_name: str) -> ServiceSpec:
        """The definition of the service `package/Name`; errors as for `message`."""
        if type_name not in self._services:
            file = self.file("srv", type_name)
            self._services[type_name] = parse_service(_read(file), type_name, file)
        return self._services[type_name]

    def file(self, kind: str, type_name: str) -> str:
        """The path of the file that defines a type; `kind` is `msg` or `srv`.

        Raises:
            NotFound: there is no such package or file.
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
        what = "message" if kind == "msg" else "service"
        raise NotFound(f"there is no {what} {name} in package {package}: looked for {candidates[0]}")

    def names(self, kind: str, package: str) -> list[str]:
        """The names of all types of a package, sorted; `kind` is `msg` or `srv`.

        Raises:
            NotFound: there is no such package.
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


def _read(file: str) -> str:
    try:
        with open(file, encoding="utf-8", newline="") as stream:
            text = stream.read(FILE_LIMIT_BYTES + 1)
    except (OSError, UnicodeDecodeError) as error:
        raise DefinitionError(f"cannot be read: {error}", file=file) from None
    if len(text) > FILE_LIMIT_BYTES:
        raise DefinitionError(f"is longer than {FILE_LIMIT_BYTES} bytes", file=file)
    return text


def _stems(folder: str, extension: str) -> list[str]:
    try:
        return [file[: -len(extension)] for file in os.listdir(folder) if file.endswith(extension)]
    except OSError:
        return []


def _stem(file: str) -> str:
    return os.path.splitext(os.path.basename(file))[0]
