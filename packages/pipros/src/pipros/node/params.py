"""A node's access to the parameter server, with a cache that follows changes.

Theory of operation. `get_cached` subscribes to a parameter on the first read: the master responds with the
value, and from then on sends `paramUpdate` notices when another node changes the parameter or a parameter
below it. Each cached parameter has a state:

    JOINING    The node has subscribed, but the first value has not arrived. Reads query the master.
    OVERTAKEN  Like JOINING, but a notice arrived first, so the first value may be older than the notice.
    CURRENT    Reads return the cached value.
    STALE      The value may be out of date. The next read queries the master and sets the state to CURRENT.

    event                      JOINING    OVERTAKEN  CURRENT                    STALE
    first value, or a new one
    after a restart of the
    master                     CURRENT    STALE      CURRENT                    STALE
    notice                     OVERTAKEN  OVERTAKEN  CURRENT, or STALE if the   STALE
                                                     new value does not follow
                                                     from the notice
    invalidation               OVERTAKEN  OVERTAKEN  STALE                      STALE

The master notifies a node of the node's own changes only if it deletes a key, or sets one above a subscribed
one, and any notice may be older than a change by this node. So once a node has set or deleted a key, notices
about it, or about keys above and below it, only make cached parameters STALE.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from copy import copy
from enum import Enum, auto
from typing import Any

from pipros.basics import names
from pipros.basics.errors import NotFound, Refused
from pipros.net.master_client import MasterClient
from pipros.node.registration import ParameterEntry, Registrations


class CacheState(Enum):
    """The state of a cached parameter; see the module docstring."""

    JOINING = auto()
    OVERTAKEN = auto()
    CURRENT = auto()
    STALE = auto()


_INVALIDATED = {
    CacheState.JOINING: CacheState.OVERTAKEN,
    CacheState.OVERTAKEN: CacheState.OVERTAKEN,
    CacheState.CURRENT: CacheState.STALE,
    CacheState.STALE: CacheState.STALE,
}
_REGISTERED = {
    CacheState.JOINING: CacheState.CURRENT,
    CacheState.OVERTAKEN: CacheState.STALE,
    CacheState.CURRENT: CacheState.CURRENT,
    CacheState.STALE: CacheState.STALE,
}


class CachedParameter:
    """One cached parameter. The value `{}` means "not set": the master sends it for a deleted parameter.

    Attributes:
        changes: number of times the value was changed or invalidated; used to detect an outdated response.
    """

    __slots__ = ("changes", "key", "state", "value")

    def __init__(self, key: str, state: CacheState = CacheState.JOINING, value: Any = None) -> None:
        self.key = key
        self.state = state
        self.value = {} if value is None else value
        self.changes = 0

    def registered(self, value: Any) -> None:
        """Store the value from the master's response to the subscription."""
        self.changes += 1
        self.state, self.value = _REGISTERED[self.state], value

    def invalidate(self) -> None:
        """Mark the value as possibly outdated."""
        self.changes += 1
        self.state = _INVALIDATED[self.state]

    def refreshed(self, value: Any, changes: int) -> None:
        """Store a value that was requested when `changes` had the given value, unless it may be outdated."""
        if self.state is CacheState.STALE and changes == self.changes:
            self.state, self.value = CacheState.CURRENT, value

    def notice(self, key: str, value: Any) -> None:
        """Apply a notice about the parameter itself, or about a parameter below it."""
        if self.state is not CacheState.CURRENT:
            self.invalidate()
        elif key == self.key:
            self.changes += 1
            self.value = value
        elif value == {}:  # deleted, or an empty namespace: both cause the same notice
            self.invalidate()
        else:
            self.changes += 1
            self._put(key[len(self.key.rstrip("/")) + 1 :].split("/"), value)

    def _put(self, path: list[str], value: Any) -> None:
        if not isinstance(self.value, dict):  # the value has become a namespace
            self.value = {}
        tree = self.value
        *above, last = path
        for part in above:
            below = tree.get(part)
            if not isinstance(below, dict):
                below = tree[part] = {}
            tree = below
        tree[last] = value


class Parameters:
    """Reads and writes parameters. The node resolves their names.

    A missing parameter raises NotFound; a value that XML-RPC cannot represent raises TypeError, OverflowError
    or ValueError before anything is sent. A namespace is read as nested dictionaries. May be used from any
    thread.
    """

    def __init__(
        self,
        master: MasterClient,
        resolve: Callable[[str], str],
        registrations: Callable[[], Registrations | None],
    ) -> None:
        """Store the arguments.

        `registrations` returns None before the node starts; until then, nothing is cached.
        """
        self._master = master
        self._resolve = resolve
        self._registrations = registrations
        self._cache: dict[str, CachedParameter] = {}
        self._changed_here: set[str] = set()  # keys that the node itself has set or deleted
        self._observers: list[Callable[[], object]] = []
        self._lock = threading.Lock()

    def get(self, name: str) -> Any:
        return self._fetch(self._resolve(name))

    def for_names(self, resolve: Callable[[str], str]) -> Parameters:
        """Return an object that shares the cache, but resolves names with `resolve`."""
        other = copy(self)
        other._resolve = resolve
        return other

    def get_cached(self, name: str) -> Any:
        """Like `get`, but cache the value, and subscribe to changes of the parameter at the master.

        Changes made by the node itself take effect immediately in all affected cached parameters. While the
        parameter is not set, every call queries the master.
        """
        key = self._resolve(name)
        registrations = self._registrations()
        if registrations is None:
            return self._fetch(key)
        with self._lock:
            known = self._cache.get(key)
            cached = self._cache[key] = known or CachedParameter(key)
        if known is None:
            registrations.add(ParameterEntry(key, lambda value: self._registered(cached, value)))
        with self._lock:
            state, value, changes = cached.state, cached.value, cached.changes
        if state is CacheState.CURRENT and value != {}:
            return value
        if state is CacheState.STALE:
            return self._refresh(cached, changes)
        return self._fetch(key)

    def _fetch(self, key: str) -> Any:
        try:
            return self._master.get_param(key)
        except Refused as error:
            raise NotFound(f"parameter [{key}] is not set") from error

    def _refresh(self, cached: CachedParameter, changes: int) -> Any:
        """Fetch the current value of a stale parameter from the master.

        The parameter stays stale if the master cannot be reached.
        """
        try:
            value = self._fetch(cached.key)
        except NotFound:
            with self._lock:
                cached.refreshed({}, changes)
            raise
        with self._lock:
            cached.refreshed(value, changes)
        return value

    def _registered(self, cached: CachedParameter, value: Any) -> None:
        with self._lock:
            cached.registered(value)

    def set(self, name: str, value: Any) -> None:
        key = self._resolve(name)
        try:
            self._master.set_param(key, value)
        finally:
            self._note_own_change(key)

    def has(self, name: str) -> bool:
        return self._master.has_param(self._resolve(name))

    def delete(self, name: str) -> None:
        key = self._resolve(name)
        try:
            self._master.delete_param(key)
        except Refused as error:
            raise NotFound(f"parameter [{key}] is not set") from error
        finally:
            self._note_own_change(key)

    def observe(self, observer: Callable[[], object]) -> None:
        """Call `observer`, which must not block, after each change of a cached parameter, in any thread."""
        self._observers.append(observer)

    def search(self, name: str) -> str | None:
        """Search for a parameter from the node's namespace upwards. Return its full name, or None."""
        try:
            return self._master.search_param(names.text_of(name))
        except Refused:
            return None

    def names(self) -> list[str]:
        return self._master.get_param_names()

    def update(self, key: str, value: Any) -> bool:
        """Apply a change that the master announced; return False if the parameter is not cached.

        The key may refer to a parameter below a cached namespace. Source: the `paramUpdate` call in
        http://wiki.ros.org/ROS/Slave_API
        """
        key = names.canonicalize(key)
        with self._lock:
            concerned = [cached for cached in self._cache.values() if _is_within(key, cached.key)]
            is_changed_here = any(_are_related(key, own) for own in self._changed_here)
            for cached in concerned:
                if is_changed_here:  # the cached value may be newer than the notice
                    cached.invalidate()
                else:
                    cached.notice(key, value)
        self._notify_observers(concerned)
        return bool(concerned)

    def cached_around(self, key: str) -> list[str]:
        """Return the cached parameters at, above and below a key."""
        key = names.canonicalize(key)
        with self._lock:
            return [cached for cached in self._cache if _are_related(key, cached)]

    def invalidate(self, key: str) -> None:
        """Invalidate cached parameters at, above and below a key: the next read queries the master."""
        key = names.canonicalize(key)
        with self._lock:
            concerned = [cached for cached in self._cache.values() if _are_related(key, cached.key)]
            for cached in concerned:
                cached.invalidate()
        self._notify_observers(concerned)

    def _notify_observers(self, concerned: Sequence[CachedParameter]) -> None:
        if concerned:
            for observer in self._observers:
                observer()

    def _note_own_change(self, key: str) -> None:
        with self._lock:
            self._changed_here.add(key)
        self.invalidate(key)


def _is_within(key: str, namespace: str) -> bool:
    return key == namespace or key.startswith(namespace.rstrip("/") + "/")


def _are_related(key: str, other: str) -> bool:
    """Return whether the keys are equal or one is a namespace that contains the other."""
    return _is_within(key, other) or _is_within(other, key)
