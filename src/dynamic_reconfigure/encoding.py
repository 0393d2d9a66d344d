"""Configurations and descriptions to messages and back."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from typing import Any

from dynamic_reconfigure.msg import (
    BoolParameter,
    DoubleParameter,
    GroupState,
    IntParameter,
    ParamDescription,
    StrParameter,
)
from dynamic_reconfigure.msg import Config as ConfigMsg
from dynamic_reconfigure.msg import ConfigDescription as ConfigDescrMsg
from dynamic_reconfigure.msg import Group as GroupMsg
from pipros.reconfigure.cfg_file import parameters as extract_params

__all__ = [
    "Config",
    "decode_config",
    "decode_description",
    "encode_config",
    "encode_description",
    "encode_groups",
    "extract_params",
    "get_tree",
    "group_dict",
    "initial_config",
]


class Config(dict[str, Any]):
    """A dictionary whose values are attributes, too."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(name) from None

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value

    def copy(self) -> Config:
        return Config(self)

    def __deepcopy__(self, memo: dict[int, Any]) -> Config:
        return type(self)({key: deepcopy(value, memo) for key, value in self.items()})


def encode_description(descr: Any) -> ConfigDescrMsg:
    """The message that describes a configuration's module."""
    return ConfigDescrMsg(
        groups=encode_groups(None, descr.config_description),
        max=encode_config(descr.max),
        min=encode_config(descr.min),
        dflt=encode_config(descr.defaults),
    )


def encode_groups(parent: Any, group: Any) -> list[Any]:  # noqa: ARG001 # as others call it
    """The messages of a group and of those in it."""
    fields = ("name", "type", "level", "description", "edit_method")
    described = [ParamDescription(*(each[field] for field in fields)) for each in group["parameters"]]
    message = GroupMsg(group["name"], group["type"], described, group["parent"], group["id"])
    return [message, *(found for inner in group["groups"] for found in encode_groups(message, inner))]


def encode_config(config: Any, flat: bool = True) -> ConfigMsg:
    """The message of a configuration; a value that is a dictionary is its tree of groups."""
    message = ConfigMsg()
    for name, value in config.items():
        if isinstance(value, bool):
            message.bools.append(BoolParameter(name, value))
        elif isinstance(value, int):
            message.ints.append(IntParameter(name, value))
        elif isinstance(value, str):
            message.strs.append(StrParameter(name, value))
        elif isinstance(value, float):
            message.doubles.append(DoubleParameter(name, value))
        elif isinstance(value, dict) and flat:
            message.groups += [_state(value), *_states_below(value)]
        elif isinstance(value, dict | list):
            message.groups = [_state(each) for each in value]
    return message


def _state(group: Any) -> GroupState:
    return GroupState(group["name"], group["state"], group["id"], group["parent"])


def _states_below(group: Any) -> Iterator[GroupState]:
    for inner in group["groups"].values():
        yield from _states_below(inner)
        yield _state(inner)


def group_dict(group: Any) -> Config:
    """A group or the state of one, without what is in it."""
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
    """The groups of a message as a tree: the root, or what is in `group`."""
    if group is None:
        root = next((each for each in m.groups if each.id == 0), None)
        if root is None:
            return Config()
        tree = group_dict(root)
        tree["groups"] = get_tree(m, root)
        return tree
    children = Config()
    for each in m.groups:
        if each.id != 0 and each.parent == group.id:
            child = group_dict(each)
            child["groups"] = get_tree(m, each)
            children[child["name"]] = child
    return children


def _values(msg: Any) -> Config:
    return Config({each.name: each.value for each in (*msg.bools, *msg.ints, *msg.strs, *msg.doubles)})


def initial_config(msg: Any, description: Any = None) -> Config:
    """The configuration of a message, with the states and values of groups by a `.cfg` description."""
    config = _values(msg)
    if msg.groups and description is not None:
        described = {group["id"]: group for group in _all_groups(description)}
        config["groups"] = get_tree(msg)

        def fill(group: Any) -> None:
            known = described[group["id"]]
            group["state"] = known["state"]
            for parameter in known["parameters"]:
                group["parameters"][parameter["name"]] = config[parameter["name"]]
            for inner in group["groups"].values():
                fill(inner)

        fill(config["groups"])
    return config


def _all_groups(group: Any) -> list[Any]:
    return [group, *(found for inner in group["groups"] for found in _all_groups(inner))]


def decode_config(msg: Any, description: Any = None) -> Config:
    """The configuration of a message; with a decoded description, values are in their groups, too."""
    config = _values(msg)
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
    """The tree of groups with their parameters that a message describes."""
    low, high, standard = (_values(part) for part in (msg.min, msg.max, msg.dflt))
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
