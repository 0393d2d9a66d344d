"""`rosmaster.paramserver`: the parameters of a master; a facade of `pipros.master.params`."""

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
"""Nodes, `(caller_id, api)` each, a parameter, and its new value."""

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
    """The parameters of a master. Safe to use from several threads.

    Attributes:
        reg_manager: knows who subscribes to parameters; None when nobody does.
    """

    def __init__(self, reg_manager: RegistrationManager | None, tree: ParamTree | None = None) -> None:
        """`tree` holds the parameters. (Not in Noetic.)"""
        self.lock = threading.RLock()
        self.reg_manager = reg_manager
        self._tree = ParamTree() if tree is None else tree

    @property
    def parameters(self) -> dict[str, Any]:
        """The whole tree."""
        tree: dict[str, Any] = self._tree.get(GLOBALNS)
        return tree

    def get_param_names(self) -> list[str]:
        """The names of all parameters."""
        with self.lock:
            return self._tree.names()

    def get_param(self, key: str) -> Any:
        """A value, or the dictionary of a namespace.

        Raises:
            KeyError: it is not set.
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
        """Sets a parameter, or replaces a namespace.

        Args:
            notify_task: called with the notices for subscribers, if there are any.
            caller_id: who sets it, and is not notified.

        Raises:
            TypeError: the root is set to something other than a dictionary.
        """
        with self.lock:
            try:
                self._tree.set(key, value)
            except NotATree as error:
                raise TypeError(str(error)) from None
            self._tell(notify_task, key, value, caller_id)

    def delete_param(self, key: str, notify_task: Callable[[list[Update]], object] | None = None) -> None:
        """Removes a parameter or a namespace; see `set_param`.

        Raises:
            KeyError: it is not set, or is the root.
        """
        with self.lock:
            if key == GLOBALNS:
                raise KeyError("cannot delete root of parameter tree")
            try:
                self._tree.delete(key)
            except NotSet:
                raise KeyError(key) from None
            self._tell(notify_task, key, {}, None)

    def search_param(self, ns: str, key: str) -> str | None:
        """The full name of the closest parameter whose first part is there, from a namespace upwards.

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
        """Registers `(caller_id, api)` for changes of a parameter; returns its value, `{}` if it has none."""
        key = as_namespace(canonicalize_name(key))
        with self.lock:
            if self.reg_manager is not None:
                self.reg_manager.register_param_subscriber(key, *registration_args)
            return self._tree.get(key) if self._tree.has(key) else {}

    def unsubscribe_param(self, key: str, unregistration_args: tuple[str, str]) -> Unregistered:
        """Takes `subscribe_param` back: `(1, what happened, how many)`."""
        key = as_namespace(canonicalize_name(key))
        with self.lock:
            if self.reg_manager is None:
                return 1, f"[{unregistration_args[0]}] is not a registered node", 0
            return self.reg_manager.unregister_param_subscriber(key, *unregistration_args)

    def _tell(
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
    """The notices about the change of a parameter; a deleted one has the value `{}`.

    A subscriber at or above the parameter gets its name and value; one below its own part of the value,
    `{}` when there is none. `caller_id_to_ignore`, which made the change, is left out of the former.
    """
    changed = as_namespace(canonicalize_name(param_key))
    whole: list[Update] = []
    parts: list[Update] = []
    for key in subscribers.iterkeys():
        own = as_namespace(key)
        nodes = subscribers[key]
        if changed.startswith(own):
            nodes = [node for node in nodes if caller_id_to_ignore is None or node[0] != caller_id_to_ignore]
            whole.append((nodes, changed, param_value))
        elif own.startswith(changed) and isinstance(param_value, dict):
            part = value_below(param_value, own[len(changed) :], {})
            (parts if part != {} else whole).append((nodes, key, part))
    return whole + parts
