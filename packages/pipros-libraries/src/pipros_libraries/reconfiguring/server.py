"""A dynamic_reconfigure server for nodes that do not use rospy, with the same rules as in roscpp.

See http://wiki.ros.org/dynamic_reconfigure. All settings are in one group, `Default`.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics.errors import NotFound
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros_libraries.nodes.params import read

Value = bool | int | float | str

_INT: Final = 2**31
_KINDS: Final = (
    ("bools", bool, "bool"),
    ("ints", int, "int"),
    ("strs", str, "str"),
    ("doubles", float, "double"),
)
"""Message field, Python type and name of each setting type. `bool` precedes its base class `int`."""


@dataclass(frozen=True, slots=True)
class Setting:
    """A setting that can be changed at run time.

    Attributes:
        default: the default value. Its type is the setting's type.
        low, high: bounds to which numbers are clamped; None for no bound.
        level: bits that are passed to `apply` if the setting changes.
        edit_method: the constants of an enum, in the format that dynamic_reconfigure generates from `.cfg`
            files.
    """

    name: str
    default: Value
    low: float | None = None
    high: float | None = None
    description: str = ""
    level: int = 0
    edit_method: str = ""

    @property
    def bounds(self) -> tuple[Any, Any]:
        """The bounds in the setting's description message."""
        if isinstance(self.default, bool):
            return False, True
        if isinstance(self.default, str):
            return "", ""
        whole = isinstance(self.default, int)
        low, high = (-_INT, _INT - 1) if whole else (-math.inf, math.inf)
        kind = type(self.default)
        return kind(low if self.low is None else self.low), kind(high if self.high is None else self.high)

    def read(self, value: Any) -> Value:
        """Return a parameter's value clamped to the bounds, or the default if it has another type.

        Values are converted as in roscpp; see `pipros_libraries.nodes.params`.
        """
        low, high = self.bounds
        if isinstance(value, float) and not isinstance(self.default, bool | str):
            value = min(max(value, low), high)
        found = read(value, self.default)
        if isinstance(found, bool | str):
            return found
        return self.default if math.isnan(found) else min(max(found, low), high)


class Reconfigurable:
    """Serves the settings of a namespace through the service `set_parameters` and two latched topics.

    The settings are read from the parameter server, clamped, and written back. Changes are applied one at a
    time, in threads of the node. If there is a setting `restore_defaults`, as in navigation, setting it to
    true restores the values that all settings had at startup.

    Attributes:
        values: the current settings by name. The mapping is replaced by each change.
    """

    def __init__(
        self,
        node: Node,
        namespace: str,
        settings: Sequence[Setting],
        apply: Callable[[Mapping[str, Value], int], Mapping[str, Value] | None],
    ) -> None:
        """Read the settings, call `apply` once with all bits of the level set, and offer the service.

        Args:
            namespace: the namespace of the settings, such as `~` or `~costmap`.
            apply: called with all settings, and the bitwise OR of the levels of changed settings. If it
                returns settings, these replace the given settings.
        """
        self._node = node
        self._prefix = namespace if namespace.endswith(("~", "/")) else f"{namespace}/"
        self._settings = {each.name: each for each in settings}
        self._apply = apply
        self._lock = threading.RLock()
        self._config: Any = load_message_class("dynamic_reconfigure/Config")
        given = _namespace(node, namespace)
        self.values: Mapping[str, Value] = {each.name: each.read(given.get(each.name)) for each in settings}
        description: Any = load_message_class("dynamic_reconfigure/ConfigDescription")
        described = node.advertise(
            f"{self._prefix}parameter_descriptions", description, latch=True, queue_size=1
        )
        described.publish(self._description(description))
        self._updates = node.advertise(
            f"{self._prefix}parameter_updates", self._config, latch=True, queue_size=1
        )
        self._first = self.values
        self._change(self.values, 0xFFFFFFFF)
        service: Any = load_service_class("dynamic_reconfigure/Reconfigure")
        node.serve(
            f"{self._prefix}set_parameters",
            service,
            lambda request: service._response_class(self._set(request)),
        )

    def update(self, changes: Mapping[str, Value]) -> None:
        """Change settings as a client would."""
        with self._lock:
            new = dict(self.values)
            for name, value in changes.items():
                if name in new and value == value:  # ignore NaN
                    new[name] = self._settings[name].read(value)
            level = 0
            for name, setting in self._settings.items():
                level |= setting.level if new[name] != self.values[name] else 0
            self._change(new, level)

    def _set(self, request: Any) -> Any:
        changes = {
            each.name: each.value
            for field, kind, _ in _KINDS
            for each in getattr(request.config, field)
            if each.name in self._settings and type(self._settings[each.name].default) is kind
        }
        with self._lock:
            self.update(changes)
            return self._message(self.values.items())

    def _change(self, values: Mapping[str, Value], level: int) -> None:
        with self._lock:
            if values.get("restore_defaults"):
                values = {**self._first, "restore_defaults": False}
            self.values = dict(self._apply(values, level) or values)
            for name, value in self.values.items():
                self._node.params.set(f"{self._prefix}{name}", value)
            self._updates.publish(self._message(self.values.items()))

    def _message(self, values: Iterable[tuple[str, Value]]) -> Any:
        message = self._config()
        for name, value in values:
            field, kind = next((field, kind) for field, _, kind in _KINDS if kind == _type_name(value))
            entry: Any = load_message_class(f"dynamic_reconfigure/{kind.capitalize()}Parameter")
            getattr(message, field).append(entry(name, value))
        message.groups.append(load_message_class("dynamic_reconfigure/GroupState")("Default", True, 0, 0))
        return message

    def _description(self, description: Any) -> Any:
        parameter: Any = load_message_class("dynamic_reconfigure/ParamDescription")
        group: Any = load_message_class("dynamic_reconfigure/Group")
        settings = self._settings.values()
        parameters = [
            parameter(each.name, _type_name(each.default), each.level, each.description, each.edit_method)
            for each in settings
        ]
        return description(
            [group("Default", "", parameters, 0, 0)],
            self._message((each.name, each.bounds[1]) for each in settings),
            self._message((each.name, each.bounds[0]) for each in settings),
            self._message((each.name, each.default) for each in settings),
        )


def _namespace(node: Node, name: str) -> Mapping[str, Any]:
    try:
        values = node.params.get(name)
    except NotFound:
        return {}
    return values if isinstance(values, dict) else {}


def _type_name(value: Value) -> str:
    return next(name for _, kind, name in _KINDS if isinstance(value, kind))
