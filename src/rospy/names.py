"""The names of the default node."""

from __future__ import annotations

from pipros import names
from pipros.names import canonicalize as canonicalize_name
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
    if not caller_id:
        return session.resolve(name)
    remappings = session.node.identity.remappings if session.node is not None else {}
    return names.resolve(name, caller_id, remappings)


def resolve_name_without_node_name(name: str) -> str:
    """As `resolve_name`, for use before the node has its name.

    Raises:
        ValueError: for a private name, which needs the node's.
    """
    if names.is_private(name):
        raise ValueError(f"~name topics cannot be created before init_node() has been called: [{name}]")
    return session.resolve(name)


def remap_name(name: str, caller_id: str | None = None, resolved: bool = True) -> str:
    """What the remapping arguments make of `name`; unchanged without one."""
    if not resolved:
        return get_mappings().get(name, name)
    return get_resolved_mappings().get(names.resolve(name, caller_id or session.name), name)


def scoped_name(caller_id: str, name: str) -> str:
    """`name` as it reads from within the namespace of `caller_id`.

    Raises:
        ValueError: `name` is not below that namespace.
    """
    ns, full = names.namespace(caller_id), names.canonicalize(name)
    if not full.startswith(ns):
        raise ValueError(f"{name} is not in the namespace of {caller_id}")
    return full[len(ns) :]


def get_mappings() -> dict[str, str]:
    """The remapping arguments of the node as they were written, `__log` and its kind included."""
    return dict(session.remappings)


def get_resolved_mappings() -> dict[str, str]:
    """The remapping arguments of the node as global names, `__log` and its kind as they were written."""
    if session.node is None:
        return {}
    return {**session.node.identity.arguments.special, **session.node.identity.remappings}
