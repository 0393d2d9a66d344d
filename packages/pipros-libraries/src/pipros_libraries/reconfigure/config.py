"""Decode configurations and their descriptions from a server's messages, and encode changes. Performs no I/O.

Messages are any objects with the fields of `dynamic_reconfigure/Config` or `ConfigDescription`.
"""

from __future__ import annotations

from ast import literal_eval
from collections.abc import Mapping, Sequence
from copy import deepcopy
from functools import lru_cache
from typing import Any

from pipros.basics.errors import PiprosError
from pipros_libraries.reconfigure.generator import TYPES

EDIT_METHOD_CHARACTERS = 100_000
"""Limit: the constants of one dynamic_reconfigure enum. Beyond it, the parameter is treated as if it had no
constants.
"""

_TRUE = ("yes", "true", "t", "1")
_LISTS = {"bool": "bools", "int": "ints", "str": "strs", "double": "doubles"}


class BadValue(PiprosError):
    """A parameter or group does not exist, or a parameter does not accept a value."""


class Config(dict[str, Any]):
    """A dictionary whose values are also accessible as attributes."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(name) from None

    def __setattr__(self, name: str, value: object) -> None:
        self[name] = value

    def copy(self) -> Config:
        return Config(self)

    def __deepcopy__(self, memo: dict[int, Any]) -> Config:
        return type(self)({key: deepcopy(value, memo) for key, value in self.items()})


def group_dict(group: Any) -> Config:
    """Return a group's or a group state's fields, with empty `groups` and `parameters`."""
    return Config(
        id=group.id,
        parent=group.parent,
        name=group.name,
        type=getattr(group, "type", ""),
        state=getattr(group, "state", True),
        groups=Config(),
        parameters=Config(),
    )


def get_tree(m: Any, group: Any = None) -> Config:
    """Return the tree of the groups in a message: the root or, if `group` is given, its subgroups by name.

    If there is no root group, return an empty tree. If several groups have the same ID, use the first one.
    """
    placed = {0} if group is None else {0, group.id}
    by_parent: dict[int, list[Any]] = {}
    for each in m.groups:
        by_parent.setdefault(each.parent, []).append(each)
    if group is not None:
        return _below(by_parent, group, placed)
    root = next((each for each in m.groups if each.id == 0), None)
    if root is None:
        return Config()
    tree = group_dict(root)
    tree["groups"] = _below(by_parent, root, placed)
    return tree


def _below(by_parent: Mapping[int, Sequence[Any]], group: Any, placed: set[int]) -> Config:
    children = Config()
    for each in by_parent.get(group.id, ()):
        if each.id not in placed:
            placed.add(each.id)  # a peer may send groups that contain each other
            child = group_dict(each)
            child["groups"] = _below(by_parent, each, placed)
            children[child["name"]] = child
    return children


def values(message: Any) -> Config:
    """Return a configuration's parameters by name."""
    lists = (message.bools, message.ints, message.strs, message.doubles)
    return Config({each.name: each.value for each in (part for some in lists for part in some)})


def decode_config(msg: Any, description: Any = None) -> Config:
    """Decode the configuration in a message.

    If the message contains groups and the decoded `description` is given, the result contains the tree of
    groups under the key `groups`, and each group contains the values of its parameters.
    """
    config = values(msg)
    if msg.groups and description is not None:
        config["groups"] = get_tree(msg)
        _fill_groups(config, config["groups"], description)
    return config


def _fill_groups(config: Config, group: Any, described: Any) -> None:
    for parameter in described["parameters"]:
        if parameter["name"] in config:
            group[parameter["name"]] = config[parameter["name"]]
    known = described["groups"]
    inner = {each["name"]: each for each in (known.values() if isinstance(known, dict) else known)}
    for each in group.get("groups", {}).values():
        if each["name"] in inner:
            _fill_groups(config, each, inner[each["name"]])


def decode_description(msg: Any) -> Config:
    """Decode the tree of groups and parameters that a message describes.

    Raises:
        KeyError: a bound or a default is missing.
    """
    low, high, standard = (values(part) for part in (msg.min, msg.max, msg.dflt))
    by_id = {group.id: group for group in msg.groups}
    tree = get_tree(msg)

    def fill(group: Any) -> None:
        group["parameters"] = [
            {
                "name": each.name,
                "min": low[each.name],
                "max": high[each.name],
                "default": standard[each.name],
                "type": each.type,
                "level": each.level,
                "description": each.description,
                "edit_method": each.edit_method,
            }
            for each in by_id[group["id"]].parameters
        ]
        for inner in group["groups"].values():
            fill(inner)

    if tree:
        fill(tree)
    return tree


def constants(edit_method: str) -> list[dict[str, Any]]:
    """Return the constants of an enum, ignoring malformed constants.

    The string comes from a peer, so only literals are parsed. Strings longer than
    `EDIT_METHOD_CHARACTERS` are not parsed, because Python's parser needs about 360 bytes per
    character.
    """
    if not edit_method or len(edit_method) > EDIT_METHOD_CHARACTERS:
        return []
    return [dict(each) for each in _constants(edit_method)]


@lru_cache(maxsize=64)
def _constants(edit_method: str) -> Sequence[Mapping[str, Any]]:
    try:
        found = literal_eval(edit_method)["enum"]
        return [each for each in found if _is_constant(each)]
    except (ValueError, SyntaxError, KeyError, TypeError, AttributeError, MemoryError, RecursionError):
        return []


def _is_constant(found: object) -> bool:
    if not isinstance(found, dict) or not isinstance(found.get("name"), str):
        return False
    kind, value = TYPES.get(str(found.get("type"))), found.get("value")
    if kind is None or not isinstance(value, (bool, int, float, str)):
        return False
    try:
        return not isinstance(kind(value), int) or -(2**63) <= kind(value) < 2**63
    except (ValueError, OverflowError):
        return False


def converted(described: Any, value: Any) -> Any:
    """Convert a value to a parameter's type. For an enum, the name of a constant is also accepted.

    For a bool, the strings `yes`, `true`, `t` and `1` mean True, and all other strings mean False. Case is
    ignored.

    Args:
        described: the parameter, as returned by `decode_description`.

    Raises:
        BadValue: the parameter does not accept the value.
    """
    wanted = TYPES.get(described["type"], str)
    if isinstance(value, str):
        if wanted is bool:
            return value.lower() in _TRUE
        for constant in constants(described["edit_method"]):
            if value.lower() == constant["name"].lower():
                return TYPES[constant["type"]](constant["value"])
    try:
        return wanted(value)
    except (TypeError, ValueError, OverflowError) as error:
        raise BadValue(f"can't set parameter '{described['name']}' of {wanted}: {error}") from error


def change_fields(
    description: object, changes: Mapping[str, object], states: Mapping[str, bool] | None = None
) -> dict[str, list[dict[str, Any]]]:
    """Return the fields of a `dynamic_reconfigure/Config` message that requests the given changes.

    Args:
        description: the result of `decode_description`.
        changes: values by parameter name.
        states: group states by name. Other groups keep their state.

    Raises:
        BadValue: a parameter or a group does not exist, or a parameter does not accept a value.
    """
    fields: dict[str, list[dict[str, Any]]] = {name: [] for name in (*_LISTS.values(), "groups")}
    groups = list(all_groups(description))
    described = {each["name"]: each for group in groups for each in group["parameters"]}
    for name, value in changes.items():
        if name not in described:
            raise BadValue(f"don't know parameter: {name}")
        kind = described[name]["type"]
        entry = {"name": name, "value": converted(described[name], value)}
        fields[_LISTS.get(kind, "strs")].append(entry)
    by_name = {group["name"]: group for group in groups}
    for name, state in (states or {}).items():
        if name not in by_name:
            raise BadValue(f"don't know group: {name}")
        group = by_name[name]
        entry = {"name": name, "state": bool(state), "id": group["id"], "parent": group["parent"]}
        fields["groups"].append(entry)
    return fields


def all_groups(group: Any) -> list[Any]:
    """Return a decoded group and all its subgroups."""
    inner = group.get("groups", {})
    below = inner.values() if isinstance(inner, dict) else inner
    return [group, *(found for each in below for found in all_groups(each))] if group else []
