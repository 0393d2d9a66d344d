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
        self._stale: set[str] = set()  # cached keys to be asked for again
        self._ours: set[str] = set()  # keys that the node itself has changed
        self._joining: set[str] = set()  # cached keys whose first value is still on its way
        self._changes = 0
        self._lock = threading.Lock()

    def get(self, name: str) -> Any:
        key = self._resolve(name)
        try:
            return self._master.get_param(key)
        except Refused as error:
            raise NotFound(f"parameter [{key}] is not set") from error

    def get_cached(self, name: str) -> Any:
        """As `get`, but asks the master only once: changes come to the node by themselves.

        What the node itself has set or deleted is seen at once, in all cached parameters concerned.
        """
        key = self._resolve(name)
        registrations = self._registrations()
        if registrations is None:
            return self.get(name)
        with self._lock:
            is_known = key in self._cache
            if not is_known:
                self._cache[key] = {}
                self._joining.add(key)
        if not is_known:
            registrations.add(ParameterEntry(key, lambda value: self.update(key, value, is_new=True)))
        with self._lock:
            value, is_stale = self._cache[key], key in self._stale
        if is_stale:
            return self._refresh(key)
        if value == {}:  # how the master announces that a parameter is not set, or was deleted
            return self.get(name)
        return value

    def _refresh(self, key: str) -> Any:
        """Asks the master for a cached value that may be out of date."""
        with self._lock:
            changes = self._changes
        value: Any = {}
        try:
            value = self._master.get_param(key)
        except Refused as error:
            raise NotFound(f"parameter [{key}] is not set") from error
        finally:
            with self._lock:
                if changes == self._changes:  # else it may be out of date again
                    self._cache[key] = value
                    self._stale.discard(key)
        return value

    def set(self, name: str, value: Any) -> None:
        key = self._resolve(name)
        try:
            self._master.set_param(key, value)
        finally:
            self._forget(key)

    def has(self, name: str) -> bool:
        return self._master.has_param(self._resolve(name))

    def delete(self, name: str) -> None:
        key = self._resolve(name)
        try:
            self._master.delete_param(key)
        except Refused as error:
            raise NotFound(f"parameter [{key}] is not set") from error
        finally:
            self._forget(key)

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
            self._changes += 1
            if is_new:
                self._cache[key] = value
                self._joining.discard(key)
                return True
            concerned = [one for one in self._cache if _is_within(key, one)]
            for one in concerned:
                is_ours = any(_is_within(key, ours) or _is_within(ours, key) for ours in self._ours)
                if is_ours or one in self._joining:  # what is known may be newer
                    self._stale.add(one)
                else:
                    self._take_over(one, key, value)
            return bool(concerned)

    def _take_over(self, cached: str, key: str, value: Any) -> None:
        """Puts a value that is new at the master into a cached parameter at or above its key."""
        if key == cached:
            self._cache[cached] = value
            return
        if value == {}:  # deleted, or an empty namespace
            self._stale.add(cached)
            return
        tree = self._cache[cached]
        *path, last = key[len(cached.rstrip("/")) + 1 :].split("/")
        if not isinstance(tree, dict):
            tree = self._cache[cached] = {}
        for part in path:
            tree = tree.setdefault(part, {})
        tree[last] = value

    def _forget(self, key: str) -> None:
        """Has cached parameters asked for again that the node itself has changed.

        The master does not tell a node of its own changes, and what it tells of those of others may
        have been under way for longer: from now on it only says that the key is to be asked for again.
        """
        with self._lock:
            self._changes += 1
            self._ours.add(key)
            self._stale.update(one for one in self._cache if _is_within(key, one) or _is_within(one, key))


def _is_within(key: str, namespace: str) -> bool:
    return key == namespace or key.startswith(namespace.rstrip("/") + "/")
