"""The parameter server as a node sees it, with a cache that follows changes."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from pipros import names
from pipros.errors import NotFound, Refused
from pipros.net.master import MasterClient
from pipros.node.registration import ParameterEntry, Registrations


class Parameters:
    """Reads and writes parameters by names as the node resolves them.

    A missing parameter raises NotFound; a value that XML-RPC cannot carry raises TypeError or
    OverflowError before anything is sent. Values of a namespace are nested dictionaries.
    """

    def __init__(
        self,
        master: MasterClient,
        resolve: Callable[[str], str],
        registrations: Callable[[], Registrations | None],
    ) -> None:
        self._master = master
        self._resolve = resolve
        self._registrations = registrations
        self._cache: dict[str, Any] = {}
        self._lock = threading.Lock()

    def get(self, name: str) -> Any:
        key = self._resolve(name)
        try:
            return self._master.get_param(key)
        except Refused as error:
            raise NotFound(f"parameter [{key}] is not set") from error

    def get_cached(self, name: str) -> Any:
        """As `get`, but asks the master only once: changes come to the node by themselves."""
        key = self._resolve(name)
        registrations = self._registrations()
        if registrations is None:
            return self.get(name)
        with self._lock:
            known = key in self._cache
        if not known:
            registrations.add(ParameterEntry(key, lambda value: self.update(key, value, is_new=True)))
        with self._lock:
            value = self._cache.get(key, {})
        if value == {}:  # how the master announces that a parameter is not set, or was deleted
            return self.get(name)
        return value

    def set(self, name: str, value: Any) -> None:
        self._master.set_param(self._resolve(name), value)

    def has(self, name: str) -> bool:
        return self._master.has_param(self._resolve(name))

    def delete(self, name: str) -> None:
        key = self._resolve(name)
        try:
            self._master.delete_param(key)
        except Refused as error:
            raise NotFound(f"parameter [{key}] is not set") from error

    def search(self, name: str) -> str | None:
        """The full name of the closest parameter, looking upwards from the node; None if there is none."""
        try:
            return self._master.search_param(name)
        except Refused:
            return None

    def names(self) -> list[str]:
        return self._master.get_param_names()

    def update(self, key: str, value: Any, *, is_new: bool = False) -> bool:
        """Takes over a change that the master announced; False when the parameter is not cached.

        The key may name a parameter below a cached namespace. Source: the `paramUpdate` call of
        http://wiki.ros.org/ROS/Slave_API
        """
        key = names.canonicalize(key)
        with self._lock:
            if is_new or key in self._cache:
                self._cache[key] = value
                return True
            above = next((one for one in self._cache if key.startswith(one.rstrip("/") + "/")), None)
            if above is None:
                return False
            tree = self._cache[above]
            *path, last = key[len(above.rstrip("/")) + 1 :].split("/")
            if not isinstance(tree, dict):
                tree = self._cache[above] = {}
            for part in path:
                tree = tree.setdefault(part, {})
            tree[last] = value
            return True
