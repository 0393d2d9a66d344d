"""Message classes created at run time from the full definition in a connection header or a bag.

Such a class does not belong to a module, so its pickled messages include the full definition. Unpickling
recreates the class from this definition, even in a process in which the type is not installed. If the class
still exists, it is reused.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from functools import cache
from typing import Any
from weakref import WeakValueDictionary

from pipros.basics.limits import Limits, limit_text, process_limits
from pipros.msg.base import Message
from pipros.msg.compile.compiler import message_source
from pipros.msg.compile.layout import TypeLayouts
from pipros.msg.compile.run import run
from pipros.msg.language.digest import check_nesting, embedded_types
from pipros.msg.language.full_text import specs_from_text
from pipros.msg.language.spec import DefinitionError, MessageSpec

DEFINITION_COPIES_BYTES = 64 * 1024 * 1024
"""Limit: the definitions of all types in one definition, each including its embedded types. Beyond it, the
definition is refused.
"""


def message_classes_from_text(
    type_name: str, full_text: str, limits: Limits | None = None
) -> dict[str, type[Message]]:
    """Return the classes for all types in a full definition, by type name.

    Installed types with the same names are ignored.

    Args:
        limits: defaults to the process-wide limits.

    Raises:
        DefinitionError: a definition is invalid, an embedded type is missing, or the text exceeds the limits.
    """
    limits = limits or process_limits()
    specs = checked_specs(type_name, full_text, limits)
    classes: dict[str, type[Message]] = {}

    def make(name: str) -> type[Message]:
        if name not in classes:
            source, embedded = message_source(specs[name], specs.__getitem__, limits)
            namespace: dict[str, Any] = {alias: make(inner) for inner, alias in embedded.items()}
            namespace["__name__"] = __name__
            made = run(source, namespace, f"<message {name}>")[specs[name].name]
            made.__name__ = made.__qualname__ = f"_{name.replace('/', '__')}"  # genpy uses the same name
            _classes().add(made)
            classes[name] = made
        return classes[name]

    return {name: make(name) for name in specs}


def checked_specs(type_name: str, full_text: str, limits: Limits | None = None) -> dict[str, MessageSpec]:
    """Return the types defined in a full definition, by name; see `message_classes_from_text` for errors."""
    limits = limits or process_limits()
    specs = specs_from_text(type_name, full_text)
    _check_together(specs, limits)
    return specs


def _check_together(specs: Mapping[str, MessageSpec], limits: Limits) -> None:
    """Check the total size of the code and definitions of all types, each with its embedded types.

    Raises:
        DefinitionError: see `message_classes_from_text`.
    """
    lookup = specs.__getitem__
    check_nesting(specs.values(), lookup)
    where = next(iter(specs.values())).file
    layouts = TypeLayouts(lookup)
    fields = sum(layouts.of(spec).code_size for spec in specs.values())
    if fields > limits.definition_fields:
        limit = limit_text("definition_fields", limits.definition_fields)
        raise DefinitionError(f"the types in the text have {fields} fields in total; {limit}", file=where)
    bytes_left = DEFINITION_COPIES_BYTES
    for spec in specs.values():
        bytes_left -= len(spec.text) + sum(len(inner.text) for inner in embedded_types(spec, lookup).values())
        if bytes_left < 0:
            raise DefinitionError(
                f"the definitions of the types in the text, each with its embedded types, exceed "
                f"{DEFINITION_COPIES_BYTES} bytes in total",
                file=where,
            )


class DynamicClasses:
    """The classes that were created from full definitions and are still in use.

    Unpickling a message looks up its class here.
    """

    def __init__(self) -> None:
        self._in_use: WeakValueDictionary[tuple[str, str], type[Message]] = WeakValueDictionary()

    def add(self, cls: type[Message]) -> None:
        """Register a class, without keeping it alive, and add the methods that `pickle` and `copy` call."""
        self._in_use[cls._type, cls._full_text] = cls
        added: Any = cls
        added.__reduce_ex__ = _reduce
        added.__copy__ = _copy
        added.__deepcopy__ = _deepcopy

    def get(self, type_name: str, full_text: str) -> type[Message]:
        """Return the class for a full message definition, creating it if necessary.

        Raises the same errors as `message_classes_from_text`.
        """
        cls = self._in_use.get((type_name, full_text))
        return cls or message_classes_from_text(type_name, full_text)[type_name]


@cache
def _classes() -> DynamicClasses:
    """Return this process's registry. It is global, because `pickle` cannot pass a registry to `_restore`."""
    return DynamicClasses()


def _reduce(message: Message, _protocol: int) -> tuple[Any, ...]:
    return _restore, (message._type, message._full_text), message.__getstate__()


def _restore(type_name: str, full_text: str) -> Message:
    return object.__new__(_classes().get(type_name, full_text))


def _copy(message: Message) -> Message:
    made = object.__new__(type(message))
    made.__setstate__(message.__getstate__())
    return made


def _deepcopy(message: Message, memo: dict[int, Any]) -> Message:
    made = object.__new__(type(message))
    memo[id(message)] = made
    made.__setstate__(copy.deepcopy(message.__getstate__(), memo))
    return made
