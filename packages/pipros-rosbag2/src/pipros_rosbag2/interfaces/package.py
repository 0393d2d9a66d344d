"""Translate the message, service and action files of a ROS 1 package into those of a ROS 2 package."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from pipros.basics.errors import NotFound
from pipros.msg.language.definitions import Definitions
from pipros.msg.language.spec import MessageSpec
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog, Ros1Definitions, carried
from pipros_rosbag2.interfaces.derive import changes, derived_message, member_name, type_name_of
from pipros_rosbag2.interfaces.parse import embedded_names
from pipros_rosbag2.interfaces.spec import Ros2Message

_NEEDS = {
    "msg": (),
    "srv": ("service_msgs",),
    "action": ("action_msgs", "builtin_interfaces", "service_msgs", "unique_identifier_msgs"),
}
"""The packages whose types ROS 2 adds to each kind of definition."""


_PARTS = {"msg": ("",), "srv": ("_Request", "_Response"), "action": ("_Goal", "_Result", "_Feedback")}
"""What follows the name of a definition in the names of its messages."""

_Files = dict[str, Sequence[Ros2Message]]


@dataclass(frozen=True, slots=True)
class Ros2Package:
    """The definitions of a package in ROS 2.

    Attributes:
        files: the text of each file, such as `msg/Status.msg`.
        changes: what differs from the definitions of ROS 1, a line each.
        needs: the other packages whose types the definitions contain.
    """

    name: str
    files: Mapping[str, str]
    changes: tuple[str, ...]
    needs: frozenset[str]


def ros2_package(name: str, distribution: str, definitions: Definitions) -> Ros2Package:
    """Translate a ROS 1 package, or take the definitions of a package that pipros bundles.

    Raises:
        NotFound: the package does not exist, has no definitions, or contains a type that ROS 2 lacks.
        DefinitionError: a definition is invalid.
    """
    ros1 = Ros1Definitions(definitions.message, definitions.service)
    catalog = Catalog(Distribution(distribution), ros1, derive=True)
    lines: list[str] = []
    files: _Files = {
        _file(kind, new): [catalog.message(f"{new}{part}") for part in _PARTS[kind]]
        for kind, new in _bundled(name, Distribution(distribution))
    }
    if not files:
        files, lines = _translated(name, definitions, catalog)
    if not files:
        raise NotFound(f"package {name} has no messages, services or actions")
    needs = {need for file in files for need in _NEEDS[file.partition("/")[0]]}
    for file, parts in files.items():
        for embedded in itertools.chain.from_iterable(map(embedded_names, parts)):
            try:
                catalog.message(embedded)
            except NotFound as error:
                raise NotFound(f"{name}/{file}: {error}") from None
            needs.add(embedded.partition("/")[0])
    texts = {file: "---\n".join(part.text() for part in parts) for file, parts in files.items()}
    own = member_name(name)
    return Ros2Package(own, texts, tuple(lines), frozenset(needs - {own}))


def _translated(name: str, definitions: Definitions, catalog: Catalog) -> tuple[_Files, list[str]]:
    """Return the files of a translated package, and what differs. Its messages are added to the catalog."""
    files: _Files = {}
    lines: list[str] = []
    for kind, old in _of_ros1(name, definitions):
        new, specs = type_name_of(old, kind), _specs(definitions, kind, old)
        messages = [derived_message(spec) for spec in specs]
        files[_file(kind, new)] = messages
        if kind == "msg":
            catalog.add({new: messages[0]})
        if new != old.replace("/", f"/{kind}/"):
            lines.append(f"{old} becomes {new}")
        lines += [line for spec in specs for line in changes(spec)]
    return files, lines


def _file(kind: str, type_name: str) -> str:
    return f"{kind}/{type_name.rpartition('/')[2]}.{kind}"


def _bundled(package: str, distribution: Distribution) -> Iterator[tuple[str, str]]:
    known = carried(distribution)
    for name in sorted(known.same_messages | known.same_services | known.texts.keys()):
        if name.startswith(f"{package}/"):
            yield name.split("/")[1], name


def _of_ros1(package: str, definitions: Definitions) -> Iterator[tuple[str, str]]:
    for kind in ("msg", "srv", "action"):
        for name in definitions.files.names(kind, package):
            file = definitions.files.file(kind, f"{package}/{name}")
            if file.endswith(f".{kind}"):  # not made of an action
                yield kind, f"{package}/{name}"


def _specs(definitions: Definitions, kind: str, name: str) -> Sequence[MessageSpec]:
    if kind == "msg":
        return [definitions.message(name)]
    if kind == "srv":
        service = definitions.service(name)
        return [service.request, service.response]
    return definitions.action(name).messages[:3]
