"""ROS 2 types: bundled with pipros, found in the user's folders, or derived from ROS 1 types.

The file `carried.msgs` contains the bundled types: it lists those with the same fields as in ROS 1, and
defines those that differ.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

from pipros.basics.errors import NotFound
from pipros.basics.input_file import read_text
from pipros.msg.language.digest import DEPTH_LIMIT
from pipros.msg.language.full_text import DEFINITION_BYTES
from pipros.msg.language.spec import DefinitionError, MessageSpec, ServiceSpec
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.action_types import Ros2Action
from pipros_rosbag2.interfaces.derive import derived_action, derived_message, derived_service
from pipros_rosbag2.interfaces.idl import parse_idl
from pipros_rosbag2.interfaces.parse import (
    embedded_names,
    parse_ros2_action,
    parse_ros2_message,
    parse_ros2_service,
)
from pipros_rosbag2.interfaces.parts import owner_of, parts_of
from pipros_rosbag2.interfaces.spec import CompleteRos2Message, Ros2Message, Ros2Service

_PARTS = ("Goal", "Result", "Feedback")


@dataclass(frozen=True, slots=True)
class Ros1Definitions:
    """Functions that return a ROS 1 definition by its name, or raise NotFound."""

    message: Callable[[str], MessageSpec]
    service: Callable[[str], ServiceSpec]


@dataclass(frozen=True, slots=True)
class Carried:
    """The content of `carried.msgs` for one distribution."""

    same_messages: frozenset[str]
    same_services: frozenset[str]
    texts: Mapping[str, str]

    @property
    def messages(self) -> frozenset[str]:
        """The names of all messages."""
        return self.same_messages | {name for name in self.texts if "/msg/" in name}


@cache
def carried(distribution: Distribution) -> Carried:
    """Return the bundled types of a distribution."""
    text = files("pipros_rosbag2.interfaces").joinpath("carried.msgs").read_text("utf-8")
    head, *sections = text.split("\n=== ")
    same: dict[str, set[str]] = {"same": set(), "service": set()}
    for line in head.splitlines():
        title, _, names = line.partition(": ")
        kind, package, *distributions = title.split()
        if kind in same and distribution.value in distributions:
            middle = "msg" if kind == "same" else "srv"
            same[kind].update(f"{package}/{middle}/{name}" for name in names.split())
    texts = {}
    for section in sections:
        title, _, body = section.partition("\n")
        name, *distributions = title.split()
        if distribution.value in distributions:
            texts[name] = body
    return Carried(frozenset(same["same"]), frozenset(same["service"]), texts)


class Catalog:
    """ROS 2 definitions, by name. Each is read once.

    A type is looked up in `folders`, then in the bundled types, and then, if `derive` is true, in the
    ROS 1 types of the same name.

    Args:
        ros1: the ROS 1 definitions.
        folders: folders that contain packages with `.msg`, `.srv`, `.action` or `.idl` files, such as ROS 2's
            `share` folder or a workspace's `src` folder.
        derive: whether to derive from ROS 1 the types that are found nowhere else, except those of bundled
            packages.
    """

    def __init__(
        self,
        distribution: Distribution,
        ros1: Ros1Definitions,
        folders: Sequence[str | os.PathLike[str]] = (),
        *,
        derive: bool = False,
    ) -> None:
        self.distribution = distribution
        self._ros1 = ros1
        self._folders = [Path(each) for each in folders]
        self._derive = derive
        self._carried = carried(distribution)
        self._messages: dict[str, Ros2Message] = {}
        self._services: dict[str, Ros2Service] = {}
        self._actions: dict[str, Ros2Action] = {}

    def add(self, messages: Mapping[str, Ros2Message]) -> None:
        """Add definitions, such as those in a bag. They take precedence over all others."""
        self._messages.update(messages)

    def add_derived(self, specs: Mapping[str, MessageSpec]) -> None:
        """Add types derived from ROS 1, except those that are known or that a package lacks in ROS 2 only."""
        for spec in specs.values():
            made = derived_message(spec)
            if not self._is_carried_package(made.type, of_both=True) and not self.has_message(made.type):
                self._messages[made.type] = made

    def message(self, name: str) -> Ros2Message:
        """Return the definition of `package/msg/Name`.

        Raises:
            NotFound: the type is unknown.
            DefinitionError: its definition is invalid or cannot be read.
        """
        if name not in self._messages:
            text = self._text(name)
            if text is not None:
                self._messages[name] = _of_idl(text, "")[0] if _is_idl(text) else parse_ros2_message(*text)
            elif self._may_derive(name, self._carried.same_messages):
                self._messages[name] = derived_message(self._ros1.message(name.replace("/msg/", "/")))
            elif owner := owner_of(name):
                whole = self.service(owner) if "/srv/" in owner else self.action(owner)
                self._messages[name] = parts_of(whole)[name]
            else:
                raise self._unknown(name)
        return self._messages[name]

    def service(self, name: str) -> Ros2Service:
        """Return the definition of `package/srv/Name`. Raises the same errors as `message`."""
        if name not in self._services:
            text = self._text(name)
            if text is not None:
                self._services[name] = (
                    Ros2Service(name, *_of_idl(text, "_Request", "_Response"))
                    if _is_idl(text)
                    else parse_ros2_service(*text)
                )
            elif self._may_derive(name, self._carried.same_services):
                self._services[name] = derived_service(self._ros1.service(name.replace("/srv/", "/")))
            else:
                raise self._unknown(name)
        return self._services[name]

    def action(self, name: str) -> Ros2Action:
        """Return the definition of `package/action/Name`. Raises the same errors as `message`."""
        if name not in self._actions:
            text = self._text(name)
            if text is not None:
                self._actions[name] = (
                    Ros2Action(name, *_of_idl(text, *(f"_{part}" for part in _PARTS)))
                    if _is_idl(text)
                    else parse_ros2_action(*text)
                )
            elif self._may_derive(name, frozenset()):
                old = name.replace("/action/", "/")
                goal, result, feedback = (self._ros1.message(old + part) for part in _PARTS)
                self._actions[name] = derived_action(goal, result, feedback)
            else:
                raise self._unknown(name)
        return self._actions[name]

    def complete(self, message: Ros2Message) -> CompleteRos2Message:
        """Return a definition with all embedded types. Raises the same errors as `message`."""
        return CompleteRos2Message(message, embedded_messages(message, self.message))

    def has_message(self, name: str) -> bool:
        """Return whether `message` would find the type."""
        return _is_found(self.message, name)

    def has_service(self, name: str) -> bool:
        """Return whether `service` would find the type."""
        return _is_found(self.service, name)

    def has_action(self, name: str) -> bool:
        """Return whether `action` would find the type."""
        return _is_found(self.action, name)

    def is_derived(self, name: str) -> bool:
        """Return whether a type is neither in a folder nor bundled, so that it can only be derived."""
        known = self._carried.same_messages | self._carried.same_services
        return name not in known and self._text(name) is None

    def _may_derive(self, name: str, same: frozenset[str]) -> bool:
        return name in same or (self._derive and not self._is_carried_package(name))

    def _is_carried_package(self, name: str, *, of_both: bool = False) -> bool:
        """Return whether the type's package is bundled. Types missing from such a package are not derived.

        Args:
            of_both: only if ROS 1 has the package, too, unlike `rcl_interfaces`, whose types are all ROS 2's.
        """
        package = name.partition("/")[0] + "/"
        known = self._carried.same_messages | self._carried.same_services
        return any(
            each.startswith(package) for each in (known if of_both else known | self._carried.texts.keys())
        )

    def _text(self, name: str) -> tuple[str, str, str] | None:
        """Return a definition, its type and its file; None if it is neither in a folder nor bundled."""
        package, kind, base = name.split("/")
        for path in self._paths(package, kind, base):
            if path.is_file():
                try:
                    return (
                        read_text(os.fspath(path), DEFINITION_BYTES),
                        name,
                        os.fspath(path),
                    )
                except (OSError, UnicodeDecodeError) as error:
                    raise DefinitionError(f"cannot be read: {error}", file=os.fspath(path)) from None
        text = self._carried.texts.get(name)
        return None if text is None else (text, name, "")

    def _paths(self, package: str, kind: str, base: str) -> Iterator[Path]:
        for folder in self._folders:
            for suffix in (kind, "idl"):
                yield folder / package / kind / f"{base}.{suffix}"
                if folder.name == package:
                    yield folder / kind / f"{base}.{suffix}"

    def _unknown(self, name: str) -> NotFound:
        searched = ", ".join(map(str, self._folders)) or "no folder was given"
        return NotFound(
            f"the type {name} is unknown in ROS 2 {self.distribution.value}; "
            f"give the folder that contains its package (searched: {searched})"
        )


def _is_idl(text: tuple[str, str, str]) -> bool:
    return text[2].endswith(".idl")


def _of_idl(text: tuple[str, str, str], *suffixes: str) -> list[Ros2Message]:
    """Return the structures in the text of an `.idl` file whose names are a type's with these suffixes."""
    definition, name, file = text
    found = parse_idl(definition, file)
    missing = [f"{name}{suffix}" for suffix in suffixes if f"{name}{suffix}" not in found]
    if missing:
        raise DefinitionError(f"the file does not define {missing[0]}", file=file)
    return [found[f"{name}{suffix}"] for suffix in suffixes]


def _is_found(find: Callable[[str], object], name: str) -> bool:
    try:
        find(name)
    except NotFound:
        return False
    return True


def embedded_messages(message: Ros2Message, lookup: Callable[[str], Ros2Message]) -> dict[str, Ros2Message]:
    """Return all types that a message embeds, directly or indirectly, by name.

    Raises:
        NotFound: a type is unknown.
        DefinitionError: a type contains itself, or messages are nested too deeply.
    """
    found: dict[str, Ros2Message] = {}
    heights: dict[str, int] = {}

    def visit(outer: Ros2Message, above: tuple[str, ...]) -> int:
        height = 0
        for name in embedded_names(outer):
            if name in above or len(above) + heights.get(name, 1) > DEPTH_LIMIT:
                reason = (
                    "a message cannot contain itself" if name in above else "messages are nested too deeply"
                )
                raise DefinitionError(f"{reason}: {name}", file=outer.file)
            if name not in heights:
                found[name] = lookup(name)
                heights[name] = 1 + visit(found[name], (*above, name))
            height = max(height, heights[name])
        return height

    visit(message, (message.type,))
    return found
