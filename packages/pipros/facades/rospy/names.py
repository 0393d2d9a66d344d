"""Names of the default node, and name resolution."""

from __future__ import annotations

import typing as _typing
from collections.abc import Mapping, Sequence
from typing import Any

from pipros.basics import names
from pipros.basics.names import canonicalize as canonicalize_name
from pipros.basics.names import is_global as is_global
from pipros.basics.names import is_private as is_private
from pipros.basics.names import join as ns_join
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
    """Return the full name of the node. Before `init_node`, the name without its namespace is `unnamed`."""
    return session.name


get_caller_id = get_name


def _set_caller_id(caller_id: str) -> None:
    """Set the full name that the process has until `init_node`."""
    session.before.caller_id = caller_id


def get_namespace() -> str:
    """Return the namespace of the node, with a trailing slash."""
    return session.namespace


def resolve_name(name: str, caller_id: str | None = None) -> str:
    """Resolve and remap `name` for the node `caller_id`, by default this node. Return the global name."""
    identity = session.identity
    return identity.resolve_for(caller_id or identity.name, name or "")


def resolve_name_without_node_name(name: str) -> str:
    """Resolve and remap a topic that is created before the node has its name.

    Raises:
        ValueError: the name is private, so resolving it requires the node's name.
    """
    return session.identity.resolve_topic_without_name(name or "")


def remap_name(name: str, caller_id: str | None = None, resolved: bool = True) -> str:
    """Return the target, as a global name, of the remapping argument whose source is literally `name`.

    Without such an argument, return `name` unchanged.
    """
    del resolved  # Noetic also ignores this argument.
    identity = session.identity
    return identity.remap(name, caller_id or identity.name)


def scoped_name(caller_id: str, name: str) -> str:
    """Return `name` relative to the namespace of `caller_id`.

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
    """Return the process's remapping arguments as written, including special ones such as `__log`."""
    arguments = session.identity.arguments
    return {**arguments.special, **arguments.remappings}


def get_resolved_mappings() -> dict[str, str]:
    """Return the node's remapping arguments as global names.

    Special arguments such as `__log` stay as written. The result is empty before init_node, unless
    `initialize_mappings` was called.
    """
    if session.node is None and not session.before.has_resolved_remappings:
        return {}
    identity = session.identity
    return {**identity.arguments.special, **identity.remappings}


def reload_mappings(argv: Sequence[str]) -> None:
    """Replace the remappings with those from another command line.

    The new remappings take effect when `initialize_mappings` is called.
    """
    session.before.read_arguments(argv)


def initialize_mappings(node_name: str) -> None:
    """Resolve the remappings relative to `node_name`, a full name. `init_node` does this itself."""
    session.before.resolve_remappings_for(node_name)


def make_global_ns(name: str) -> str:
    """Return the namespace as a global name with a trailing slash.

    Raises:
        ValueError: the name is private.
    """
    return names.make_global_namespace(name)


def isstring(s: object) -> bool:
    """Return whether an object is a string."""
    return isinstance(s, str)


def get_ros_namespace(env: Mapping[str, str] | None = None, argv: Sequence[str] | None = None) -> str:
    """Return the namespace of the process; see `rosgraph.names.get_ros_namespace`."""
    from rosgraph import names as graph_names  # imported on first use: few programs need rosgraph

    return graph_names.get_ros_namespace(env, argv)


def load_mappings(argv: Sequence[str]) -> dict[str, str]:
    """Return the remappings of a command line; see `rosgraph.names.load_mappings`."""
    from rosgraph import names as graph_names

    return graph_names.load_mappings(argv)


def namespace(name: str | None) -> str:
    """Return the namespace of a name; see `rosgraph.names.namespace`."""
    from rosgraph import names as graph_names

    return graph_names.namespace(name)


def _variable(name: str) -> Any:
    """Return a module variable that some packages read, such as `_mappings`."""
    if name == "_mappings":
        return get_mappings()
    if name == "_resolved_mappings":
        return get_resolved_mappings()
    if name == "_caller_id":
        return get_name()
    if name == "_caller_namespace":
        return get_namespace()
    raise AttributeError(f"module 'rospy.names' has no attribute '{name}'")


if not _typing.TYPE_CHECKING:  # with __getattr__, type checkers would accept any name
    __getattr__ = _variable
