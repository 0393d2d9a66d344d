"""Decide which parameters a member's file lets other members read and set. Performs no I/O.

A namespace is read and set as a whole, but the rules for the parameters in it may differ from the rule for
its name. Therefore, a parameter that its own rule denies is left out when another member reads the namespace,
and a member that may not set a parameter cannot replace the namespace that contains it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.names import as_namespace, canonicalize, is_global, leaves_below
from pipros.basics.printable import printable
from pipros_fleet.fleet_rules import FleetFile, first_rule


def parameter_name(name: object) -> str:
    """Return a parameter's name as the master would use it, because rules are compared with such names.

    Raises:
        PiprosError: `name` is not a global name.
    """
    if not isinstance(name, str) or not is_global(name):
        raise PiprosError(f"a parameter must have a global name, got [{printable(name, 200)}]")
    return canonicalize(f"/{name}")


def readable(file: FleetFile, member: str, name: str, value: Any) -> Any:
    """Return the value of a parameter that a member may read, without the denied parameters below it."""
    if not isinstance(value, dict):
        return value
    found = {}
    for key, part in value.items():
        below = _joined(name, key)
        is_namespace = isinstance(part, dict) and part
        if is_namespace or not _denies(file.shared_parameters, below, member):
            kept = readable(file, member, below, part)
            if kept or not is_namespace:
                found[key] = kept
    return found


def check_set(file: FleetFile, member: str, name: str, value: Any, tree: Any) -> None:
    """Check a new value of a parameter. The caller has checked that the member may set this name.

    Args:
        tree: the current value of `top_of(name)`; None if it is not set.

    Raises:
        PiprosError: the value contains or replaces parameters that the member may not set.
    """
    rules = file.accepted_parameters
    for leaf in _leaves(name, value):
        if leaf != name and _denies(rules, leaf, member):
            raise PiprosError(f"[{member}] is not allowed to set parameter [{printable(leaf, 200)}]")
    for leaf in _leaves(top_of(name), tree):
        is_below = leaf != name and leaf.startswith(as_namespace(name))
        is_above = name.startswith(as_namespace(leaf)) and leaf != "/"
        if (is_below and _denies(rules, leaf, member)) or (
            is_above and not file.sets_parameter(leaf, member)
        ):
            raise PiprosError(f"[{member}] is not allowed to replace parameter [{printable(leaf, 200)}]")


def top_of(name: str) -> str:
    """Return the first part of a name.

    >>> top_of("/a/b/c"), top_of("/")
    ('/a', '/')
    """
    return "/" + name.split("/")[1]


def _denies(rules: Any, name: str, member: str) -> bool:
    rule = first_rule(rules, name)
    return rule is not None and not rule.accepts(member)


def _leaves(name: str, value: Any) -> Sequence[str]:
    try:
        return [leaf for leaf, _ in leaves_below(name, value, _joined)]
    except RecursionError:
        raise PiprosError(f"the value of [{printable(name, 200)}] is nested too deeply") from None


def _joined(name: str, key: str) -> str:
    return canonicalize(f"{name}/{key}")
