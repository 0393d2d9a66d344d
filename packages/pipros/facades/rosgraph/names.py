"""Names of graph resources. Facade of `pipros.basics.names`."""

from __future__ import annotations

import os
import random
import re
import socket
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from pipros.basics import names as _names
from rosgraph.rosenv import ROS_NAMESPACE

MSG_EXT = ".msg"
SRV_EXT = ".srv"
SEP = "/"
GLOBALNS = "/"
PRIV_NAME = "~"
REMAP = ":="
ANYTYPE = "*"

# Noetic's patterns, for programs that use them; the functions below use `pipros.basics.names`.
NAME_LEGAL_CHARS_P = re.compile(r"^[~/A-Za-z][\w/]*$", re.ASCII)
BASE_NAME_LEGAL_CHARS_P = re.compile(r"^[A-Za-z]\w*$", re.ASCII)
REMAP_PATTERN = re.compile(r"^[~/A-Za-z_][\w/]*:=.*", re.ASCII)

ns_join = _names.join


def isstring(s: object) -> bool:
    """Return whether the value is a string."""
    return isinstance(s, str)


def make_global_ns(name: str) -> str:
    """Return a namespace as a global name with a trailing slash.

    Raises:
        ValueError: `name` is private.
    """
    return _names.make_global_namespace(name)


def is_global(name: str) -> bool:
    """Return whether a name starts with a slash."""
    return bool(name) and _names.is_global(name)


def is_private(name: str) -> bool:
    """Return whether a name starts with a tilde."""
    return bool(name) and _names.is_private(name)


def is_legal_name(name: str | None) -> bool:
    """Return whether a name is a valid graph name; the empty name is valid."""
    return name is not None and _names.is_legal(name)


def is_legal_base_name(name: str | None) -> bool:
    """Return whether a name is valid and has no namespace."""
    return name is not None and _names.is_legal_base(name)


def canonicalize_name(name: str) -> str:
    """Return the name without repeated and trailing slashes."""
    return _names.canonicalize(name)


def namespace(name: str | None) -> str:
    """Return the namespace of a name, with a trailing slash.

    Raises:
        ValueError: `name` is None.
        TypeError: `name` is not a string.
    """
    if not isinstance(name, str):  # Noetic raises the same exceptions
        raise ValueError("name") if name is None else TypeError("name")
    return _names.namespace(name)


def make_caller_id(name: str) -> str:
    """Return the global name of the node `name` in this process's namespace, with a trailing slash."""
    return make_global_ns(ns_join(get_ros_namespace(), name))


def get_ros_namespace(env: Mapping[str, str] | None = None, argv: Sequence[str] | None = None) -> str:
    """Return this process's namespace: `__ns:=` in `argv`, or else `ROS_NAMESPACE`, or else `/`."""
    env = os.environ if env is None else env
    special = _names.parse_arguments(sys.argv if argv is None else argv).special
    return make_global_ns(special.get("__ns") or env.get(ROS_NAMESPACE) or GLOBALNS)


def resolve_name(name: str, namespace_: str, remappings: Mapping[str, str] | None = None) -> str:
    """Resolve a name relative to the node `namespace_` and apply remappings."""
    return _names.resolve(name or "", namespace_, remappings)


def script_resolve_name(script_name: str, name: str) -> str:
    """Resolve a name relative to this process's namespace, or a private name relative to `script_name`."""
    if not name:
        return get_ros_namespace()
    if is_global(name):
        return name
    if is_private(name):
        return ns_join(make_caller_id(script_name), name[1:])
    return ns_join(get_ros_namespace(), name)


def load_mappings(argv: Sequence[str]) -> dict[str, str]:
    """Return the remappings and special arguments (`__name:=`) of a command line.

    Parameters (`_name:=`) are not included.

    Malformed arguments are reported on standard error.
    """
    parsed = _names.parse_arguments(argv)
    for argument in parsed.malformed:
        print(f"ERROR: Invalid remapping argument '{argument}'", file=sys.stderr)
    legal = {key: value for key, value in parsed.remappings.items() if is_legal_remap(f"{key}:={value}")}
    return {**legal, **parsed.special}


def is_legal_remap(arg: str | None) -> bool:
    """Return whether an argument remaps a valid name, or sets a parameter or a special name (`__name`)."""
    return arg is not None and _names.is_legal_remapping(arg)


def anonymous_name(id: Any) -> str:  # noqa: A002  # Noetic's name
    """Return a unique node name, made of `id`, the host, the process ID and a random number."""
    name = f"{id}_{socket.gethostname()}_{os.getpid()}_{random.randint(0, sys.maxsize)}"  # noqa: S311
    return name.replace(".", "_").replace("-", "_").replace(":", "_")
