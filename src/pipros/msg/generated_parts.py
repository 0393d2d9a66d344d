"""Generate parts of message modules as genuine genpy does, for tools that generate such modules.

pipros does not use this source for its own classes, which `pipros.msg.compile` compiles. Types are named as
in definitions. A `context` has a method `get_registered(name)`, which returns a specification with `fields`,
`types`, `names` and `constants`, or raises KeyError if the name is unknown.
"""

from __future__ import annotations

import keyword
import os
import re
from collections.abc import Iterator, Sequence
from copy import copy
from itertools import groupby
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.msg.language.spec import BUILTINS, FLOATS, NUMBERS

SIMPLE = {**NUMBERS, "bool": "B"}
"""The types that are serialized as a single number, with their `struct` format characters."""

_HEADERS = ("Header", "std_msgs/Header")


class GenerationError(PiprosError):
    """Source cannot be generated for a type."""


class Special:
    """A built-in type, with the code to create a value and to finish reading one.

    Attributes:
        constructor: an expression that creates a value.
        post_deserialize: the call to make after reading a value, such as `%s.canon()`; None for no call.
        import_str: the required import.
    """

    def __init__(self, constructor: str, post_deserialize: str | None, import_str: str) -> None:
        self.constructor = constructor
        self.post_deserialize = post_deserialize
        self.import_str = import_str

    def get_post_deserialize(self, varname: str) -> str | None:
        """Return the `post_deserialize` call for a variable."""
        return None if self.post_deserialize is None else self.post_deserialize % varname


_SPECIAL = {
    "time": Special("genpy.Time()", "%s.canon()", "import genpy"),
    "duration": Special("genpy.Duration()", "%s.canon()", "import genpy"),
    "Header": Special("std_msgs.msg._Header.Header()", None, "import std_msgs.msg"),
}


def is_simple(type_: str) -> bool:
    """Return True for a type that is serialized as a single number."""
    return type_ in SIMPLE


def is_special(type_: str) -> bool:
    """Return True for the built-in types that have their own class: `time`, `duration` and `Header`."""
    return type_ in _SPECIAL


def special(type_: str) -> Special | None:
    """Return the code for a built-in type that has its own class, or None for other types."""
    return _SPECIAL.get(type_)


def registered(context: Any, type_: str) -> Any:
    """Return the specification of a type.

    Raises:
        GenerationError: the context does not contain the type.
    """
    try:
        return context.get_registered(type_)
    except KeyError:
        raise GenerationError(
            f"Unknown type [{type_}]. Please check that the manifest.xml correctly declares dependencies."
        ) from None


def package_and_name(package: str, type_: str) -> tuple[str, str]:
    """Return the package and name of a type that a definition in `package` uses.

    Raises:
        GenerationError: the type has more than one slash.
    """
    parts = type_.split("/")
    if len(parts) > 2:
        raise GenerationError(f"illegal message type: {type_}")
    return (package, type_) if len(parts) == 1 else (parts[0], parts[1])


def constructor(context: Any, package: str, type_: str) -> str | None:
    """Return the expression that creates a message or a time, or None for numbers, strings and arrays."""
    if type_ in _SPECIAL:
        return _SPECIAL[type_].constructor
    owner, name = package_and_name(package, type_)
    try:
        context.get_registered(f"{owner}/{name}")
    except KeyError:
        return None
    return None if "[" in name else f"{owner}.msg.{name}()"


def imports(context: Any, package: str, type_: str) -> list[str]:
    """Return the imports that the generated source for a field needs."""
    bare = type_.partition("[")[0]
    if bare == "roslib/Header":
        return ["import std_msgs.msg"]
    if bare in _SPECIAL:
        return [_SPECIAL[bare].import_str]
    if bare in BUILTINS:
        return []
    owner, name = package_and_name(package, bare)
    found = [f"import {owner}.msg"]
    if bare in _HEADERS:
        return found
    for kind in registered(context, f"{owner}/{name}").types:
        found += [line for line in imports(context, owner, kind) if line not in found]
    return found


def default_value(context: Any, field_type: str, default_package: str) -> str | None:
    """Return the expression for the default value of a field."""
    base, bracket, length = field_type.partition("[")
    if bracket:
        return _default_array(context, base, length.rstrip("]"), default_package)
    if base in FLOATS:
        return "0."
    if base == "bool":
        return "False"
    if base == "string":
        return "''"
    return "0" if base in SIMPLE else constructor(context, default_package, base)


def _default_array(context: Any, base: str, length: str, package: str) -> str:
    if base in ("uint8", "char"):
        return f"b'\\0'*{length}" if length else "b''"
    if not length:
        return "[]"
    element = default_value(context, base, package)
    if base in BUILTINS and base not in _SPECIAL:
        return f"[{element}] * {length}"
    return f"[{element} for _ in range({length})]"


def without_keywords(spec: Any) -> Any:
    """Return a copy of a specification with an underscore appended to names that are Python keywords."""
    safe = copy(spec)
    safe.names = [_safe(name) for name in spec.names]
    safe.constants = [copy(constant) for constant in spec.constants]
    for constant in safe.constants:
        constant.name = _safe(constant.name)
    return safe


def _safe(name: str) -> str:
    return f"{name}_" if keyword.iskeyword(name) else name


def flattened(context: Any, spec: Any) -> Iterator[tuple[str, str]]:
    """Yield `(type, name)` for each field. Embedded fields have dotted names. Arrays are not expanded."""
    for kind, name in spec.fields():
        if "[" in kind or (kind in BUILTINS and kind not in ("time", "duration")):
            yield kind, name
            continue
        inner = registered(context, kind)
        for inner_kind, inner_name in flattened(context, inner):
            yield inner_kind, f"{name}.{inner_name}"


def struct_pattern(types: Sequence[str] | None) -> str | None:
    """Return the `struct` format for types, or None if a type is not a number or there are no types."""
    if not types or not all(kind in SIMPLE for kind in types):
        return None
    return "".join(SIMPLE[kind] for kind in types)


def reduced_pattern(pattern: str) -> str:
    """Return a `struct` format with counts for repeated characters.

    A format that already has counts is unchanged.
    """
    if not pattern or re.search(r"\d", pattern):
        return pattern
    counted = ((letter, len(list(group))) for letter, group in groupby(pattern))
    return "".join(letter if count == 1 else f"{count}{letter}" for letter, count in counted)


def resource_name(filename: str, ext: str) -> str:
    """Return the name of the type that a file defines."""
    return os.path.basename(filename)[: -len(ext)]


def outfile_name(outdir: str, infile_name: str, ext: str) -> str:
    """Return the path of the module that is generated from a type's file."""
    return os.path.join(outdir, f"_{resource_name(infile_name, ext)}.py")
