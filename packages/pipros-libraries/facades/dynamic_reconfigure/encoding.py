"""Convert configurations and descriptions to messages and back."""

from __future__ import annotations

from collections.abc import Iterator
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
from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.reconfigure.cfg_file import parameters as extract_params
from pipros_libraries.reconfigure.config import (
    Config,
    all_groups,
    decode_config,
    decode_description,
    get_tree,
    group_dict,
    values,
)

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

_star_names(
    __name__,
    "dynamic_reconfigure.msg:BoolParameter ConfigDescrMsg=dynamic_reconfigure.msg:ConfigDescription "
    "ConfigMsg=dynamic_reconfigure.msg:Config copy dynamic_reconfigure.msg:DoubleParameter "
    "GroupMsg=dynamic_reconfigure.msg:Group dynamic_reconfigure.msg:GroupState "
    "dynamic_reconfigure.msg:IntParameter dynamic_reconfigure.msg:ParamDescription roslib "
    "dynamic_reconfigure.msg:StrParameter sys",
)


def encode_description(descr: Any) -> ConfigDescrMsg:
    """Return the message that describes a module's configuration."""
    return ConfigDescrMsg(
        groups=encode_groups(None, descr.config_description),
        max=encode_config(descr.max),
        min=encode_config(descr.min),
        dflt=encode_config(descr.defaults),
    )


def encode_groups(parent: Any, group: Any) -> list[Any]:  # noqa: ARG001 # part of the public signature
    """Return the messages that describe a group and its subgroups."""
    fields = ("name", "type", "level", "description", "edit_method")
    described = [ParamDescription(*(each[field] for field in fields)) for each in group["parameters"]]
    message = GroupMsg(group["name"], group["type"], described, group["parent"], group["id"])
    return [message, *(found for inner in group["groups"] for found in encode_groups(message, inner))]


_PARTS: tuple[tuple[type, str, Any], ...] = (
    (bool, "bools", BoolParameter),  # Check bool before int, because bool is a subclass of int.
    (int, "ints", IntParameter),
    (str, "strs", StrParameter),
    (float, "doubles", DoubleParameter),
)
"""Python type, message field and message class for each kind of parameter."""


def encode_config(config: Any, flat: bool = True) -> ConfigMsg:
    """Encode a configuration as a message.

    A dictionary value is encoded as a tree of parameter groups, and a list as a sequence of groups.
    """
    message = ConfigMsg()
    for name, value in config.items():
        for kind, part, parameter in _PARTS:
            if isinstance(value, kind):
                getattr(message, part).append(parameter(name, value))
                break
        if isinstance(value, dict) and flat:
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


def initial_config(msg: Any, description: Any = None) -> Config:
    """Decode a message to a configuration.

    If the message contains groups and `description` is given, add the tree of groups, with the groups' states
    from the description and the parameters' values from the message.
    """
    config = values(msg)
    if msg.groups and description is not None:
        described = {group["id"]: group for group in all_groups(description)}
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
