"""The parameter tree. This module performs no I/O.

A parameter is any value that XML-RPC can represent. Dictionaries are namespaces, and a key is a path through
them. Keys must be resolved (`/a/b`); doubled and trailing slashes do not matter.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final, Protocol, cast

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.basics.limits import process_limits
from pipros.master.param_weight import VALUE_BYTES, entry_weight, weigh

Tree = dict[str, Any]

LEVELS_LIMIT: Final = 90
"""Maximum number of components in a key. Together with the nesting limit for values, this ensures that the
whole tree fits into one response.
"""


class NotATree(PiprosError, ValueError):
    """The root was set to a value that is not a dictionary."""


class TooDeep(PiprosError, ValueError):
    """A key has more than `LEVELS_LIMIT` components."""


class ParamsFull(PiprosError, ValueError):
    """Setting a value would make the parameters exceed the limit on their total weight."""


class NotSet(PiprosError, KeyError):
    """A parameter is not set."""


class ParamJournal(Protocol):
    """Receives every change of a parameter tree, in order. Its methods must not block.

    A protocol because its implementation, `Store`, imports this module.
    """

    def param_set(self, key: str, value: object) -> None: ...

    def param_deleted(self, key: str) -> None: ...


class ParamTree:
    """One master's parameters. Not thread-safe.

    Values that callers have passed in or received never change, and other threads may read them: `set` and
    `delete` copy such dictionaries on the path to the key. They change their own copies in place until a
    caller receives these, so that setting many keys takes a time proportional to their number. Callers must
    not change a value that they have passed in or received.

    Attributes:
        held_bytes: the weight of all parameters together, keys included (see `param_weight`).
    """

    def __init__(self, tree: Tree | None = None, *, limit_bytes: int | None = None) -> None:
        """Store the tree, or create an empty one.

        `limit_bytes` is the maximum weight of all parameters together; it defaults to the process-wide limit
        `parameter_bytes`.
        """
        self._root: Tree = {} if tree is None else tree
        self._own: set[int] = set()  # the `id` of each dictionary in the tree that no caller has
        self._limit_bytes = process_limits().parameter_bytes if limit_bytes is None else limit_bytes
        self._known_weights: Mapping[int, int] = {}
        self.held_bytes = self._weight_of(self._root)
        self.journal: ParamJournal | None = None

    def get(self, key: str) -> Any:
        """Return a value, or a namespace as a dictionary. The key `/` is the whole tree.

        Raises:
            NotSet: the parameter is not set.
        """
        value = value_below(self._root, key, _NOTHING)
        if value is _NOTHING:
            raise NotSet(key)
        self._share(value)
        return value

    def has(self, key: str) -> bool:
        return value_below(self._root, key, _NOTHING) is not _NOTHING

    def set(self, key: str, value: Any) -> None:
        """Set a value, replacing the former value or a whole namespace.

        Plain values on the path to the key become namespaces.

        Raises:
            NotATree: the key is `/` and the value is not a dictionary.
            TooDeep: the key has more than `LEVELS_LIMIT` components.
            ParamsFull: the parameters would exceed the limit on their total weight. Nothing was changed.
        """
        parts = _parts(key)
        if len(parts) > LEVELS_LIMIT:
            raise TooDeep(f"a key has {len(parts)} components; the limit is {LEVELS_LIMIT}")
        if not parts and type(value) is not dict:
            raise NotATree("cannot set root of parameter tree to non-dictionary")
        former, missing = self._place(parts)
        growth = self._weight_of(value) + sum(map(entry_weight, missing)) + VALUE_BYTES * len(missing[1:])
        if former is not _NOTHING:
            growth -= self._weight_of(former)
            growth += VALUE_BYTES if missing else 0  # the former value becomes a namespace
        if growth > 0 and self.held_bytes + growth > self._limit_bytes:
            raise ParamsFull(
                f"{key} would bring the parameters to {self.held_bytes + growth} bytes; "
                f"the limit is {self._limit_bytes}"
            )
        self.held_bytes += growth
        self._share(former)
        if parts:
            self._put(parts, value)
        else:
            self._root = value
        if self.journal:
            self.journal.param_set(key, value)

    def former(self, key: str) -> Any:
        """Return the value that setting `key` would replace, or None if there is none.

        This may be a plain value above `key`.
        """
        former = self._place(_parts(key))[0]
        self._share(former)
        return None if former is _NOTHING else former

    @contextmanager
    def weights_known(self, weights: Mapping[int, int]) -> Iterator[None]:
        """Use the weights in `weights`, keyed by the `id` of the value, inside the block."""
        self._known_weights = weights
        try:
            yield
        finally:
            self._known_weights = {}

    def _weight_of(self, value: object) -> int:
        known = self._known_weights.get(id(value))
        return weigh(value) if known is None else known

    def _place(self, parts: list[str]) -> tuple[Any, list[str]]:
        """Return the value that setting this path would replace, and the path's missing components."""
        value: Any = self._root
        for count, part in enumerate(parts):
            if type(value) is not dict:
                return value, parts[count:]
            if part not in value:
                return _NOTHING, parts[count:]
            value = value[part]
        return value, []

    def _put(self, parts: list[str], value: object) -> None:
        self._own_namespace(parts[:-1])[parts[-1]] = value

    def _own_namespace(self, parts: list[str]) -> Tree:
        """Return the dictionary at a path, in which missing parts are created, so that it may be changed."""
        tree = self._root = self._owned(self._root)
        for part in parts:
            tree[part] = below = self._owned(tree.get(part))
            tree = below
        return tree

    def _owned(self, tree: Any) -> Tree:
        if id(tree) not in self._own:
            tree = tree.copy() if type(tree) is dict else {}
            self._own.add(id(tree))
        return cast(Tree, tree)

    def _share(self, value: object) -> None:
        """Let a caller have a value, or leave it out of the tree: `value` is not changed any more."""
        stack = [value]
        while stack:
            tree = stack.pop()
            if id(tree) in self._own:  # otherwise, it contains no dictionary that is
                self._own.remove(id(tree))
                stack += cast(Tree, tree).values()

    def delete(self, key: str) -> None:
        """Delete a value or a whole namespace.

        Raises:
            NotSet: the parameter is not set, or `key` is `/`, because the root cannot be deleted.
        """
        parts = _parts(key)
        if not parts or not self.has(key):
            raise NotSet(key)
        self.held_bytes -= self._weight_of(self.get(key)) + entry_weight(parts[-1])
        del self._own_namespace(parts[:-1])[parts[-1]]
        if self.journal:
            self.journal.param_deleted(key)

    def names(self) -> list[str]:
        """Return the full names of all values, grouped by namespace.

        Within a namespace, names are in the order in which they were first set. Empty namespaces are omitted.
        """
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
        """Search for `key` in the namespace `ns` (`/a/node`) and upwards. Return its full name, or None.

        As in ROS, only the first component of the key has to exist: if `/a/x` is set, the result for `x/y` is
        `/a/x/y`, whether or not that parameter is set.
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


def value_below(value: object, key: str, default: object) -> Any:
    """Return the value under `key` in a tree, or `default` if there is none."""
    for part in _parts(key):
        if type(value) is not dict or part not in value:
            return default
        value = value[part]
    return value
