"""The notices to send when a parameter changes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pipros.basics import names
from pipros.master.params import value_below
from pipros.master.registry import MASTER_ID, Notice, Registry, Role


def param_notices(registry: Registry, key: str, value: object, *, except_node: str) -> Iterator[Notice]:
    """Return the `paramUpdate` notices for a change of `key` to `value` (`{}` if it was deleted).

    A subscriber at or above the key receives the key and its value. A subscriber below the key receives the
    part of the value at its own key, or `{}` if there is none. `except_node`, which made the change, receives
    nothing. Announced keys end with a slash, as in genuine masters.

    The subscribed keys are looked up immediately, but their nodes only as the notices are consumed,
    because a key can have thousands of subscribers.
    """
    return _notices(registry, registry.param_keys_around(key), key, value, except_node)


def _notices(
    registry: Registry, subscribed_keys: Sequence[str], key: str, value: object, except_node: str
) -> Iterator[Notice]:
    changed = names.as_namespace(key)
    for subscribed in subscribed_keys:
        namespace = names.as_namespace(subscribed)
        if changed.startswith(namespace):
            params = (MASTER_ID, changed, value)
        else:
            params = (MASTER_ID, namespace, value_below(value, namespace[len(changed) :], {}))
        # All subscribers to a key share one tuple, so that it is encoded only once.
        for name in registry.names_of(Role.PARAM_SUBSCRIBER, subscribed):
            if name != except_node:
                yield Notice(name, registry.nodes[name].api, "paramUpdate", params)
