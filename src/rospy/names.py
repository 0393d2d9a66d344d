"""The names of the default node."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pipros import names
from pipros.names import canonicalize as canonicalize_name
from pipros.names import is_global as is_global
from pipros.names import is_private as is_private
from pipros.names import join as ns_join
from pipros.names import make_global_namespace as make_global_ns
from rospy.exceptions import ParameterInvalid as ParameterInvalid
from rospy.exceptions import ROSException
from rospy.session import session

GLOBALNS = SEP = "/"
REMAP = ":="
TOPIC_ANYTYPE = SERVICE_ANYTYPE = ANYTYPE = "*"

__all__ = [
    "ANYTYPE",
    "GLOBALNS",
    "REMAP",
    "SEP",
    "SERVICE_ANYTYPE",
    "TOPIC_ANYTYPE",
    "canonicalize_name",
    "get_caller_id",
    "get_mappings",
    "get_name",
    "get_namespace",
    "get_resolved_mappings",
    "global_name",
    "is_global",
    "is_private",
    "make_global_ns",
    "ns_join",
    "remap_name",
    "resolve_name",
    "resolve_name_without_node_name",
    "scoped_name",
]


def get_name() -> str:
    """The full name of the node; `/unnamed` before init_node."""
    return session.name


get_caller_id = get_name


def get_namespace() -> str:
    """The namespace of the node, with a trailing slash."""
    return session.namespace


def resolve_name(name: str, caller_id: str | None = None) -> str:
    """The global name that `name` means in the node `caller_id`, by default this one; remapped."""
    identity = session.identity
    return identity.resolve_for(caller_id or identity.name, name or "")


def resolve_name_without_node_name(name: str) -> str:
    """As `resolve_name`, for topics that are made before the node has its name; remapped all the same.

    Raises:
        ValueError: for a private name, which needs the node's.
    """
    return session.identity.resolve_topic_without_name(name or "")


def remap_name(name: str, caller_id: str | None = None, resolved: bool = True) -> str:
    """What a remapping argument that reads just like `name` makes of it; unchanged without one."""
    del resolved  # makes no difference in Noetic either
    identity = session.identity
    return identity.remap(name, caller_id or identity.name)


def scoped_name(caller_id: str, name: str) -> str:
    """`name` as it reads from within the namespace of `caller_id`.

    Raises:
        ROSException: `caller_id` is not a global name.
        ValueError: `name` is not below that namespace.
    """
    if not names.is_global(caller_id):
        raise ROSException("caller_id must be global")
    ns, full = names.namespace(caller_id), names.canonicalize(name)
    if not full.startswith(ns):
        raise ValueError(f"{name} is not in the namespace of {caller_id}")
    return full[len(ns) :]


def get_mappings() -> dict[str, str]:
    """The remapping arguments of the process as they were written, `__log` and its kind included."""
    arguments = session.identity.arguments
    return {**arguments.special, **arguments.remappings}


def get_resolved_mappings() -> dict[str, str]:
    """The remapping arguments of the node as global names, `__log` and its kind as they were written."""
    if session.node is None:
        return {}
    return {**session.node.identity.arguments.special, **session.node.identity.remappings}


def global_name(param_name: str) -> Callable[[object, str], str]:
    """A check for an argument of that name: `check(value, caller_id)` returns a value that is a global name.

    The check raises ParameterInvalid for any other value.
    """

    def check(value: object, caller_id: str) -> str:
        del caller_id
        if not value or not isinstance(value, str):
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a non-empty string")
        if not names.is_global(value):
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a globally referenced name")
        return value

    return check


def __getattr__(name: str) -> Any:
    """What few use, and what `rosgraph.names` has."""
    if name in ("get_ros_namespace", "load_mappings", "namespace"):
        from rosgraph import names as rosgraph_names

        return getattr(rosgraph_names, name)
    raise AttributeError(f"module 'rospy.names' has no attribute '{name}'")
