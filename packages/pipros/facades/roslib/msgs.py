"""`roslib.msgs`, for legacy scripts: names of types and messages. To read definitions, use `genmsg`."""

from __future__ import annotations

import genmsg.msgs
from genmsg.msgs import BUILTIN_TYPES as BUILTIN_TYPES
from genmsg.msgs import DURATION as DURATION
from genmsg.msgs import DURATION_MSG as DURATION_MSG
from genmsg.msgs import HEADER as HEADER
from genmsg.msgs import PRIMITIVE_TYPES as PRIMITIVE_TYPES
from genmsg.msgs import TIME as TIME
from genmsg.msgs import TIME_MSG as TIME_MSG
from genmsg.msgs import Constant as Constant
from genmsg.msgs import is_builtin as is_builtin
from genmsg.msgs import is_valid_constant_type as is_valid_constant_type
from genmsg.msgs import is_valid_msg_field_name as _is_valid_name
from genmsg.msgs import is_valid_msg_type as is_valid_msg_type
from roslib.packages import resource_file
from roslib.resources import list_package_resources

SEP = "/"
EXT = ".msg"
COMMENTCHAR = "#"
CONSTCHAR = "="

RESERVED_TYPES = [*BUILTIN_TYPES, HEADER]


class MsgSpecException(Exception):
    """A definition is invalid or cannot be found."""


def is_valid_msg_field_name(x: str | None) -> bool:
    """Return True for a valid field name."""
    return x is not None and _is_valid_name(x)


def base_msg_type(type_: str) -> str:
    """Return the type without `[]` or `[n]`."""
    return genmsg.msgs.bare_msg_type(type_)


def is_header_type(type_: str) -> bool:
    """Return True for `Header`, with or without its package."""
    return genmsg.msgs.is_header_type(type_)


def parse_type(type_: str | None) -> tuple[str, bool, int | None]:
    """Return the base type, whether the type is an array, and the length of a fixed-size array.

    Raises:
        MsgSpecException: the text is not a valid type.
    """
    try:
        return genmsg.msgs.parse_type(type_)
    except ValueError as error:
        raise MsgSpecException(str(error)) from None


def resolve_type(type_: str, package_context: str) -> str:
    """Return the full name of a type that a definition in the package `package_context` refers to."""
    bare = base_msg_type(type_)
    if bare == HEADER:
        return f"std_msgs/{type_}"
    return type_ if SEP in bare or is_builtin(bare) else f"{package_context}{SEP}{type_}"


def msg_file(package: str, type_: str) -> str:
    """Return the path of a message's definition. The file does not need to exist.

    Raises:
        InvalidROSPkgException: the package does not exist.
    """
    return resource_file(package, "msg", type_ + EXT)


def list_msg_types(package: str, include_depends: bool) -> list[str]:
    """Return the names of a package's messages.

    If `include_depends` is true, include the messages of the package's dependencies.

    Raises:
        InvalidROSPkgException: the package does not exist.
    """
    files = list_package_resources(package, include_depends, "msg", lambda file: file.endswith(EXT))
    return [name.removesuffix(EXT) for name in files]
