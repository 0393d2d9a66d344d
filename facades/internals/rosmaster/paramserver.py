"""`rosmaster.paramserver`: a master's parameters; a facade of `pipros.master.params`."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.names import as_namespace
from pipros.basics.names import canonicalize as canonicalize_name
from pipros.basics.names import is_global as is_global
from pipros.basics.names import is_private as is_private
from pipros.basics.names import join as ns_join
from pipros.master.params import NotATree, NotSet, ParamTree, value_below
from rosmaster.registrations import RegistrationManager, Registrations, Unregistered

GLOBALNS = SEP = "/"

Update = tuple[list[tuple[str, str]], str, Any]
"""Update notices, each consisting of nodes as `(caller_id, api)`, a parameter and its new value."""

__all__ = [
    "GLOBALNS",
    "SEP",
    "ParamDictionary",
    "canonicalize_name",
    "compute_param_updates",
    "is_global",
    "is_private",
    "ns_join",
]

_star_names(__name__, "threading:RLock")


class ParamDictionary:
    """A master's parameters. Thread-safe.

    Attributes:
        reg_manager: the registrations, which include the parameters' subscribers; None if there are no
            subscribers.
    """

    def __init__(self, reg_manager: RegistrationManager | None, tree: ParamTree | None = None) -> None:
        """Store the parameters in `tree`, or in a new tree. (`tree` is not in Noetic.)"""
        self.lock = threading.RLock()
        self.reg_manager = reg_manager
        self._tree = ParamTree() if tree is None else tree

    @property
    def parameters(self) -> dict[str, Any]:
        """The complete tree."""
        tree: dict[str, Any] = self._tree.get(GLOBALNS)
        return tree

    def get_param_names(self) -> list[str]:
        """Return the names of all parameters."""
        with self.lock:
            return self._tree.names()

    def get_param(self, key: str) -> Any:
        """Return a parameter's value, or a dictionary for a namespace.

        Raises:
            KeyError: the parameter is not set.
        """
        with self.lock:
            try:
                return self._tree.get(key)
            except NotSet:
                raise KeyError(key) from None

    def has_param(self, key: str) -> bool:
        with self.lock:
            return self._tree.has(key)

    def set_param(
        self,
        key: str,
        value: Any,
        notify_task: Callable[[list[Update]], object] | None = None,
        caller_id: str | None = None,
    ) -> None:
        """Set a parameter, or replace a namespace.

        Args:
            notify_task: called with the update notices for subscribers, if there are any.
            caller_id: the node that sets the parameter; it is not notified.

        Raises:
            TypeError: the root is set to something other than a dictionary.
        """
        with self.lock:
            try:
                self._tree.set(key, value)
            except NotATree as error:
                raise TypeError(str(error)) from None
            self._notify(notify_task, key, value, caller_id)

    def delete_param(self, key: str, notify_task: Callable[[list[Update]], object] | None = None) -> None:
        """Remove a parameter or a namespace; see `set_param`.

        Raises:
            KeyError: the parameter is not set, or is the root.
        """
        with self.lock:
            if key == GLOBALNS:
                raise KeyError("cannot delete root of parameter tree")
            try:
                self._tree.delete(key)
            except NotSet:
                raise KeyError(key) from None
            self._notify(notify_task, key, {}, None)

    def search_param(self, ns: str, key: str) -> str | None:
        """Return the full name of the closest match for a key, searching from a namespace upwards.

        A namespace matches if it contains the first component of the key.

        Raises:
            ValueError: the key is empty or private, or the namespace is not global.
        """
        if not key or is_private(key):
            raise ValueError("invalid key")
        if not is_global(ns):
            raise ValueError("namespace must be global")
        with self.lock:
            return self._tree.search(ns, key)

    def subscribe_param(self, key: str, registration_args: tuple[str, str]) -> Any:
        """Subscribe `(caller_id, api)` to a parameter. Return its value, or `{}` if it is not set."""
        key = as_namespace(canonicalize_name(key))
        with self.lock:
            if self.reg_manager is not None:
                self.reg_manager.register_param_subscriber(key, *registration_args)
            return self._tree.get(key) if self._tree.has(key) else {}

    def unsubscribe_param(self, key: str, unregistration_args: tuple[str, str]) -> Unregistered:
        """Undo `subscribe_param`. Return `(1, status message, number of removed subscriptions)`."""
        key = as_namespace(canonicalize_name(key))
        with self.lock:
            if self.reg_manager is None:
                return 1, f"[{unregistration_args[0]}] is not a registered node", 0
            return self.reg_manager.unregister_param_subscriber(key, *unregistration_args)

    def _notify(
        self,
        notify_task: Callable[[list[Update]], object] | None,
        key: str,
        value: Any,
        caller_id: str | None,
    ) -> None:
        if notify_task is None or self.reg_manager is None:
            return
        updates = compute_param_updates(self.reg_manager.param_subscribers, key, value, caller_id)
        if updates:
            notify_task(updates)


def compute_param_updates(
    subscribers: Registrations, param_key: str, param_value: Any, caller_id_to_ignore: str | None = None
) -> list[Update]:
    """Return the update notices for a change to a parameter. The value of a deleted parameter is `{}`.

    A subscriber of the parameter or of a parent namespace gets the parameter's name and value. A subscriber
    of a child gets the child's name and value, or `{}` if the child is not set. `caller_id_to_ignore`, the
    node that made the change, is excluded from the subscribers of the parameter and its parents.
    """
    changed = as_namespace(canonicalize_name(param_key))
    whole: list[Update] = []
    parts: list[Update] = []
    for key in subscribers.iterkeys():
        own = as_namespace(key)
        nodes = subscribers[key]
        if changed.startswith(own):
            nodes = [node for node in nodes if node[0] != caller_id_to_ignore]
            whole.append((nodes, changed, param_value))
        elif own.startswith(changed) and isinstance(param_value, dict):
            part = value_below(param_value, own[len(changed) :], {})
            (parts if part != {} else whole).append((nodes, key, part))
    return whole + parts
