"""Names of ROS 2 topics, services, actions and types in DDS and in Zenoh."""

from __future__ import annotations

import re
from dataclasses import dataclass

from pipros.basics.errors import InvalidName

GATEWAY_PREFIX = "/ros2_gateway_"
"""Prefix of the names of gateways' ROS 1 nodes; the domain's number follows."""

_NAME_LIMIT = 255
"""Maximum length of a DDS topic name, in characters."""

_PART = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_DDS_TYPE = re.compile(r"([A-Za-z]\w*)::(msg|srv|action)::dds_::([A-Za-z]\w*)_", re.ASCII)


@dataclass(frozen=True, slots=True)
class ServiceTopics:
    """The DDS topics of a service."""

    request: str
    reply: str


@dataclass(frozen=True, slots=True)
class ActionNames:
    """The full names of an action's services and topics, such as `/fibonacci/_action/send_goal`."""

    send_goal: str
    cancel_goal: str
    get_result: str
    feedback: str
    status: str


def checked_name(name: str) -> str:
    """Return `name` if it is a fully qualified ROS 2 name.

    Raises:
        InvalidName: the name does not begin with a slash, or a part does not begin with a letter or `_`
            (ROS 1 also allows digits), contains anything but letters, digits and `_`, or contains `__`.
    """
    parts = name.split("/")
    if (
        parts[0]
        or len(parts) < 2
        or not all(_PART.fullmatch(part) and "__" not in part for part in parts[1:])
    ):
        raise InvalidName(
            f"[{name}] is not a full ROS 2 name: it must begin with a slash, and each slash must be "
            "followed by a letter or _, then letters, digits and single _"
        )
    return name


def dds_topic(name: str) -> str:
    """Return the DDS name of a ROS 2 topic.

    Raises:
        InvalidName: the name breaks ROS 2's rules, or is too long.

    >>> dds_topic("/chatter")
    'rt/chatter'
    """
    return _limited(f"rt{checked_name(name)}")


def dds_service(name: str) -> ServiceTopics:
    """Return the DDS topics of a service. Raises the same errors as `dds_topic`."""
    checked_name(name)
    return ServiceTopics(_limited(f"rq{name}Request"), _limited(f"rr{name}Reply"))


def action_names(name: str) -> ActionNames:
    """Return the ROS 2 names of an action's services and topics.

    Raises:
        InvalidName: see `checked_name`.
    """
    inner = f"{checked_name(name)}/_action"
    kinds = ("send_goal", "cancel_goal", "get_result", "feedback", "status")
    return ActionNames(*(f"{inner}/{kind}" for kind in kinds))


def topic_of_dds(name: str) -> str | None:
    """Return the ROS 2 topic for a DDS topic, or None if there is none."""
    return name[2:] if name.startswith("rt/") else None


def service_of_dds(name: str) -> str | None:
    """Return the ROS 2 service to which a DDS topic belongs, or None if there is none."""
    for prefix, suffix in (("rq/", "Request"), ("rr/", "Reply")):
        if name.startswith(prefix) and name.endswith(suffix):
            return name[2 : -len(suffix)]
    return None


def dds_type(type_name: str) -> str:
    """Return the name of a ROS 2 type in DDS and Zenoh.

    >>> dds_type("std_msgs/msg/String")
    'std_msgs::msg::dds_::String_'
    >>> dds_type("std_srvs/srv/SetBool_Request")
    'std_srvs::srv::dds_::SetBool_Request_'
    """
    package, kind, name = type_name.split("/")
    return f"{package}::{kind}::dds_::{name}_"


def type_of_dds(name: str) -> str | None:
    """Return the ROS 2 type for a DDS type name, or None if there is none."""
    match = _DDS_TYPE.fullmatch(name)
    return "/".join(match.groups()) if match else None


def zenoh_key(domain: int, name: str, type_name: str, type_hash: str) -> str:
    """Return rmw_zenoh's key for a topic or a service.

    Args:
        type_hash: the type hash, or `TypeHashNotSupported` for Humble.

    Raises:
        InvalidName: the name breaks ROS 2's rules.
    """
    return f"{domain}/{checked_name(name)[1:]}/{dds_type(type_name)}/{type_hash}"


def _limited(name: str) -> str:
    if len(name) > _NAME_LIMIT:
        raise InvalidName(f"[{name[:40]}…] has more than {_NAME_LIMIT} characters in DDS")
    return name
