"""The names of the default node."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pipros import names
from pipros.names import canonicalize as canonicalize_name
from pipros.names import is_global as is_global
from pipros.names import is_private as is_private
from pipros.names import join as ns_join
from pipros.net.argument_checks import ParameterInvalid as ParameterInvalid
from pipros.net.argument_checks import global_name as global_name
from pipros.net.argument_checks import resolved_name as valid_name_validator_resolved
from pipros.net.argument_checks import unresolved_name as valid_name_validator_unresolved
from pipros.net.argument_checks import valid_name as valid_name
from rospy.exceptions import ROSException as ROSException
from rospy.exceptions import ROSInitException as ROSInitException
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
    "ParameterInvalid",
    "ROSException",
    "ROSInitException",
    "canonicalize_name",
    "get_caller_id",
    "get_mappings",
    "get_name",
    "get_namespace",
    "get_resolved_mappings",
    "get_ros_namespace",
    "global_name",
    "initialize_mappings",
    "is_global",
    "is_private",
    "isstring",
    "load_mappings",
    "make_global_ns",
    "namespace",
    "ns_join",
    "reload_mappings",
    "remap_name",
    "resolve_name",
    "resolve_name_without_node_name",
    "scoped_name",
    "valid_name",
    "valid_name_validator_resolved",
    "valid_name_validator_unresolved",
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
    """The remapping arguments of the node as global names, `__log` and its kind as they were written.

    Empty before init_node, unless `initialize_mappings` was called.
    """
    if session.node is None and not session.has_settled_remappings:
        return {}
    identity = session.identity
    return {**identity.arguments.special, **identity.remappings}


def reload_mappings(argv: Sequence[str]) -> None:
    """Takes the remappings of another command line; they count for names from `initialize_mappings` on."""
    session.read_arguments(argv)


def initialize_mappings(node_name: str) -> None:
    """Has names be remapped as those of a node of that full name. `init_node` sees to it for others."""
    session.settle_remappings(node_name)


def make_global_ns(name: str) -> str:
    """The namespace as a global one, with a slash at its end.

    Raises:
        ValueError: for a private name.
    """
    return names.make_global_namespace(name)


def isstring(s: object) -> bool:
    """Whether it is a text."""
    return isinstance(s, str)


def get_ros_namespace(env: Mapping[str, str] | None = None, argv: Sequence[str] | None = None) -> str:
    """The namespace of the process; see `rosgraph.names.get_ros_namespace`."""
    from rosgraph import names as graph_names  # with the rest of rosgraph, which few programs need

    return graph_names.get_ros_namespace(env, argv)


def load_mappings(argv: Sequence[str]) -> dict[str, str]:
    """The remappings of a command line; see `rosgraph.names.load_mappings`."""
    from rosgraph import names as graph_names

    return graph_names.load_mappings(argv)


def namespace(name: str | None) -> str:
    """The namespace of a name; see `rosgraph.names.namespace`."""
    from rosgraph import names as graph_names

    return graph_names.namespace(name)


def __getattr__(name: str) -> Any:
    """The state of names as some packages look at it."""
    if name == "_mappings":
        return get_mappings()
    if name == "_resolved_mappings":
        return get_resolved_mappings()
    if name == "_caller_id":
        return get_name()
    if name == "_caller_namespace":
        return get_namespace()
    raise AttributeError(f"module 'rospy.names' has no attribute '{name}'")
