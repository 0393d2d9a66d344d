"""The parameter tree, without any IO.

A parameter is any value that XML-RPC carries. Dictionaries are namespaces: a key is a path
through them. Keys come in resolved (`/a/b`); doubled and trailing slashes do not matter.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Final, Protocol

from pipros import names
from pipros.errors import PiprosError

Tree = dict[str, Any]

LEVELS_LIMIT: Final = 90
"""Parts of a key: with them and the depth that a value may have, the whole tree can still be told."""


class NotATree(PiprosError, ValueError):
    """The root was to be set to something that is no dictionary."""


class TooDeep(PiprosError, ValueError):
    """A key has more parts than the tree may have levels."""


class NotSet(PiprosError, KeyError):
    """A parameter is not set."""


class ParamJournal(Protocol):
    """Is told of every change of the tree, in order. Must not block."""

    def param_set(self, key: str, value: Any) -> None: ...

    def param_deleted(self, key: str) -> None: ...


class ParamTree:
    """The parameters of one master. Not for use from several threads at once.

    Values are never changed, only replaced: `set` and `delete` copy the dictionaries on the way to
    the key. So what `get` returned stays what it was, and may be read by another thread. The other
    half of the bargain: whoever hands a value in or gets one out must not change it either.
    """

    def __init__(self, tree: Tree | None = None) -> None:
        self._root: Tree = {} if tree is None else tree
        self.journal: ParamJournal | None = None

    def get(self, key: str) -> Any:
        """A value, or the dictionary of a namespace; of `/` everything.

        Raises:
            NotSet: when there is none.
        """
        value = _below(self._root, key, _NOTHING)
        if value is _NOTHING:
            raise NotSet(key)
        return value

    def has(self, key: str) -> bool:
        return _below(self._root, key, _NOTHING) is not _NOTHING

    def set(self, key: str, value: Any) -> None:
        """Sets a value; what stood there, be it a whole namespace, is gone.

        Values on the way to it give way to namespaces.

        Raises:
            NotATree: for another value than a dictionary at `/`.
            TooDeep: the key has more than `LEVELS_LIMIT` parts.
        """
        parts = _parts(key)
        if len(parts) > LEVELS_LIMIT:
            raise TooDeep(f"a key of {len(parts)} parts; the limit is {LEVELS_LIMIT}")
        if not parts:
            if type(value) is not dict:
                raise NotATree("cannot set root of parameter tree to non-dictionary")
            self._root = value
        else:
            self._put(parts, value)
        if self.journal:
            self.journal.param_set(key, value)

    def _put(self, parts: list[str], value: Any) -> None:
        tree = self._root = self._root.copy()
        for part in parts[:-1]:
            below = tree.get(part)
            tree[part] = below = below.copy() if type(below) is dict else {}
            tree = below
        tree[parts[-1]] = value

    def delete(self, key: str) -> None:
        """Deletes a value or a whole namespace.

        Raises:
            NotSet: when there is none; also for `/`, which always is.
        """
        parts = _parts(key)
        if not parts or not self.has(key):
            raise NotSet(key)
        tree = self._root = self._root.copy()
        for part in parts[:-1]:
            tree[part] = below = tree[part].copy()
            tree = below
        del tree[parts[-1]]
        if self.journal:
            self.journal.param_deleted(key)

    def names(self) -> list[str]:
        """The full names of all values, in the order they were set. An empty namespace has none."""
        found: list[str] = []
        stack = [("/", iter(self._root.items()))]
        while stack:
            ns, items = stack[-1]
            for key, value in items:
                name = names.join(ns, key)
                if type(value) is dict:
                    stack.append((name, iter(value.items())))
                    break
                found.append(name)
            else:
                stack.pop()
        return found

    def search(self, ns: str, key: str) -> str | None:
        """Looks for `key` in the namespace `ns` (`/a/node`) and upwards; None when it is nowhere.

        Only the first component of the key is looked for: with `/a/x` set, `x/y` is found as
        `/a/x/y` whether or not it is set. That is how ROS searches.
        """
        if names.is_global(key):
            return key if self.has(key) else None
        first = _parts(key)[:1]
        found = None
        tree: Any = self._root
        prefix = "/"
        for part in [*_parts(ns), ""]:
            if type(tree) is not dict:
                break
            if first and first[0] in tree:
                found = prefix
            tree = tree.get(part)
            prefix += f"{part}/"
        return None if found is None else found + key


_NOTHING: Final = object()


def _parts(key: str) -> list[str]:
    return [part for part in key.split("/") if part]


def _below(value: Any, key: str, default: Any) -> Any:
    """What stands in `value` under `key`."""
    for part in _parts(key):
        if type(value) is not dict or part not in value:
            return default
        value = value[part]
    return value


def changes_for(subscribed_keys: Iterable[str], key: str, value: Any) -> Iterator[tuple[str, str, Any]]:
    """What subscribers are told when `key` became `value` (`{}` when it was deleted).

    A subscriber at or above the key is told the key and its value; one below is told its own part
    of the value, `{}` when there is none.

    Yields:
        `(subscribed key, key to announce, value to announce)` for each one concerned; announced
        keys end with a slash.
    """
    changed = as_namespace(key)
    for subscribed in subscribed_keys:
        own = as_namespace(subscribed)
        if changed.startswith(own):
            yield subscribed, changed, value
        elif own.startswith(changed):
            yield subscribed, own, _below(value, own[len(changed) :], {})


def as_namespace(key: str) -> str:
    """A key with a slash behind: what every key below it begins with."""
    return key if key.endswith("/") else key + "/"
