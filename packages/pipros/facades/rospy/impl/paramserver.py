"""`rospy.impl.paramserver`: cache of the parameters received from the master."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from pipros.basics.lazy_names import star_names as _star_names
from rospy.names import GLOBALNS, SEP

__all__ = ["GLOBALNS", "SEP", "ParamServerCache", "get_param_server_cache"]

_star_names(__name__, "threading")


class ParamServerCache:
    """A thread-safe tree of parameter values.

    Attributes:
        d: the tree.
        lock: held during changes.
        notifier: called with the name and value of each update.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.d: dict[str, Any] = {}
        self.notifier: Callable[[str, Any], object] | None = None

    def get(self, key: str) -> Any:
        """Return a parameter's value, or a dictionary for a namespace.

        Raises:
            KeyError: the parameter is not set.
        """
        with self.lock:
            value: Any = self.d
            for part in _parts(key):
                if not isinstance(value, dict) or part not in value:
                    raise KeyError(key)
                value = value[part]
            return value

    def set(self, key: str, value: Any) -> None:
        """Set a parameter, creating missing parent namespaces.

        Raises:
            TypeError: the root is set to something other than a dictionary.
        """
        with self.lock:
            if key == GLOBALNS:
                if not isinstance(value, dict):
                    raise TypeError("cannot set root of parameter tree to non-dictionary")
                self.d = value
                return
            *above, last = _parts(key)
            tree = self.d
            for part in above:
                if not isinstance(tree.get(part), dict):
                    tree[part] = {}
                tree = tree[part]
            tree[last] = value

    def update(self, key: str, value: Any) -> None:
        """Change a value in an existing namespace, and call the notifier.

        Raises:
            KeyError: the namespace does not exist, or the parameter is in the root namespace and not set.
        """
        with self.lock:
            *above, last = _parts(key)
            tree = self.d
            if not above and last not in tree:
                raise KeyError(key)
            for part in above:
                if part not in tree:
                    raise KeyError(key)
                tree = tree[part]
            tree[last] = value
            if self.notifier is not None:
                self.notifier(key, value)

    def delete(self, key: str) -> None:
        """Remove a parameter or a namespace, and parent namespaces that become empty.

        Raises:
            KeyError: the parameter is not set, or is the root.
        """
        with self.lock:
            if key == GLOBALNS:
                raise KeyError("cannot delete root of parameter tree")
            self.get(key)
            *above, last = _parts(key)
            trees = [self.d]
            for part in above:
                trees.append(trees[-1][part])
            del trees[-1][last]
            for part, tree in zip(reversed(above), reversed(trees[:-1]), strict=True):
                if tree[part]:
                    break
                del tree[part]  # a namespace without parameters does not exist

    def set_notifier(self, notifier: Callable[[str, Any], object]) -> None:
        """Call the function with the name and value of each update."""
        self.notifier = notifier


_cache = ParamServerCache()


def get_param_server_cache() -> ParamServerCache:
    """Return the process's cache. `rospy.get_param_cached` uses a separate cache, in `pipros.node.params`."""
    return _cache


def _parts(key: str) -> list[str]:
    return [part for part in key.split(SEP) if part]
