"""`roslib.msgs`, for legacy scripts: message definitions by package. New code uses `genmsg`."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import genmsg.base
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
from pipros.basics.lazy_names import star_names as _star_names
from pipros.msg.language.parse import parse_message
from pipros.msg.language.spec import DefinitionError, MessageSpec
from roslib.packages import resource_file
from roslib.resources import list_package_resources

_star_names(__name__, "roslib rospkg io:StringIO sys")

SEP = "/"
EXT = ".msg"
COMMENTCHAR = "#"
CONSTCHAR = "="
VERBOSE = False

RESERVED_TYPES = [*BUILTIN_TYPES, HEADER]

_verbose = [VERBOSE]


class MsgSpecException(Exception):
    """A definition is invalid or cannot be found."""


def is_verbose() -> bool:
    """Return whether verbose output is enabled."""
    return _verbose[0]


def set_verbose(v: bool) -> None:
    """Enable or disable verbose output."""
    _verbose[0] = v


def _say(text: str) -> None:
    if is_verbose():
        print(text)


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


class Field(genmsg.msgs.Field):
    """A field of a message, with its type split into parts."""

    def __init__(self, name: str, type: str) -> None:  # noqa: A002  # roslib's name for it
        parse_type(type)
        super().__init__(name, type)
        self.is_header = is_header_type(self.base_type)


class MsgSpec(genmsg.msgs.MsgSpec):
    """A message definition. Types are as written, except that types from the same package are qualified."""

    def __init__(
        self,
        types: list[str],
        names: list[str],
        constants: list[Constant],
        text: str,
        full_name: str = "",
        short_name: str = "",
        package: str = "",
    ) -> None:
        for kind in types:
            parse_type(kind)
        try:
            super().__init__(types, names, constants, text, full_name)
        except genmsg.base.InvalidMsgSpec as error:
            raise MsgSpecException(str(error)) from None
        self.short_name = short_name
        self.package = package

    def parsed_fields(self) -> list[genmsg.msgs.Field]:
        return [Field(name, kind) for kind, name in self.fields()]

    def has_header(self) -> bool:
        """Return True if the first field is a Header called `header`."""
        return any(field.name == "header" and field.is_header for field in self.parsed_fields()[:1])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, MsgSpec):
            return False
        names = (self.short_name, self.package)
        return super().__eq__(other) and names == (other.short_name, other.package)

    __hash__ = None

    def __str__(self) -> str:
        """Return the fields and constants, including those of embedded messages, which must be registered."""
        return "".join(f"{line}\n" for line in self._lines(""))

    def _lines(self, indent: str) -> Iterator[str]:
        for constant in self.constants:
            yield f"{indent}{constant.type} {constant.name}={constant.val_text}"
        for kind, name in self.fields():
            yield f"{indent}{kind} {name}"
            bare = base_msg_type(kind)
            if not is_builtin(bare):
                yield from get_registered(bare)._lines(indent + "  ")


def _time_spec(text: str) -> MsgSpec:
    kind = text.partition(" ")[0]
    return MsgSpec([kind, kind], ["secs", "nsecs"], [], text)


EXTENDED_BUILTINS = {TIME: _time_spec(TIME_MSG), DURATION: _time_spec(DURATION_MSG)}

REGISTERED_TYPES: dict[str, MsgSpec] = {}
"""The registered definitions, by name."""


def reinit() -> None:
    """Clear the registry and register the header, `time` and `duration`."""
    REGISTERED_TYPES.clear()
    _, header = load_by_type("std_msgs/Header")
    for name in (HEADER, "std_msgs/Header", "roslib/Header"):
        register(name, header)
    for name, spec in EXTENDED_BUILTINS.items():
        register(name, spec)


def register(msg_type_name: str, msg_spec: MsgSpec) -> None:
    """Register a definition under a name."""
    _say(f"Register msg {msg_type_name}")
    REGISTERED_TYPES[msg_type_name] = msg_spec


def is_registered(msg_type_name: str) -> bool:
    return msg_type_name in REGISTERED_TYPES


def get_registered(msg_type_name: str, default_package: str | None = None) -> MsgSpec:
    """Return the definition of a type. A name without a package is also looked up in `default_package`.

    Raises:
        KeyError: the definition is not registered.
    """
    if msg_type_name in REGISTERED_TYPES:
        return REGISTERED_TYPES[msg_type_name]
    if default_package:
        full_name = resolve_type(msg_type_name, default_package)
        if full_name in REGISTERED_TYPES:
            return REGISTERED_TYPES[full_name]
    raise KeyError(msg_type_name)


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


def load_from_string(
    text: str, package_context: str = "", full_name: str = "", short_name: str = ""
) -> MsgSpec:
    """Parse a definition.

    Raises:
        MsgSpecException: the definition is invalid.
    """
    return spec_of(read(text, full_name), text, package_context, full_name, short_name)


def read(text: str, full_name: str) -> MessageSpec:
    """Return the definition as a pipros object.

    Raises the same errors as `load_from_string`. (Not in Noetic.)
    """
    try:
        return parse_message(text, type_name_of(full_name))
    except DefinitionError as error:
        raise MsgSpecException(str(error)) from error


def type_name_of(full_name: str) -> str:
    """Return a name of the form `package/Name`, which the parser requires. (Not in Noetic.)"""
    return full_name if full_name.count(SEP) == 1 and all(full_name.split(SEP)) else "text/Text"


def names_of_file(file: str, package_context: str, extension: str) -> tuple[str, str, str]:
    """Return the full name, short name and package of a definition file. (Not in Noetic.)"""
    short_name = os.path.basename(file).removesuffix(extension)
    package = package_context.rstrip(SEP)
    return f"{package}{SEP}{short_name}" if package else short_name, short_name, package


def spec_of(parsed: MessageSpec, text: str, package_context: str, full_name: str, short_name: str) -> MsgSpec:
    """Return the definition as a roslib object, with types as written. (Not in Noetic.)"""
    lines = text.splitlines()
    written = [lines[field.line - 1].split()[0] for field in parsed.fields]
    types = [
        kind if not package_context or base_msg_type(kind) == HEADER else resolve_type(kind, package_context)
        for kind in written
    ]
    constants = [
        Constant(constant.type, constant.name, constant.value, constant.text) for constant in parsed.constants
    ]
    names = [field.name for field in parsed.fields]
    return MsgSpec(types, names, constants, text, full_name, short_name, package_context)


def load_from_file(file_path: str, package_context: str = "") -> tuple[str, MsgSpec]:
    """Read a definition file. Return its name, qualified if the package is given, and the definition.

    Raises:
        OSError: the file cannot be read.
        MsgSpecException: the definition is invalid.
    """
    _say(f"Load spec from {file_path}")
    full_name, short_name, package = names_of_file(file_path, package_context, EXT)
    text = Path(file_path).read_text("utf-8")
    try:
        return full_name, load_from_string(text, package, full_name, short_name)
    except MsgSpecException as error:
        raise MsgSpecException(f"{file_path}: {error}") from error


def load_by_type(msgtype: str, package_context: str = "") -> tuple[str, MsgSpec]:
    """Read the definition of a type, given as `package/Name` or as a name in `package_context`.

    Raises:
        MsgSpecException: the package does not exist, or the definition is invalid.
        OSError: the definition does not exist.
    """
    from roslib.packages import InvalidROSPkgException

    package, _, name = msgtype.rpartition(SEP)
    package = package or package_context
    try:
        file = msg_file(package, name)
    except InvalidROSPkgException:
        raise MsgSpecException(
            f"Cannot locate message type [{msgtype}], package [{package}] does not exist"
        ) from None
    return load_from_file(file, package)


def get_pkg_msg_specs(package: str) -> tuple[list[tuple[str, MsgSpec]], list[str]]:
    """Return `(name, definition)` for each message in a package, and the names of unreadable messages."""
    found, failed = [], []
    for name in list_msg_types(package, False):
        try:
            found.append(load_from_file(msg_file(package, name), package))
        except (OSError, MsgSpecException) as error:
            print(f"ERROR: unable to load {name}, {error}")
            failed.append(name)
    return found, failed


def load_package(package: str) -> None:
    """Register all messages in a package.

    Raises:
        InvalidROSPkgException: the package does not exist.
    """
    _say(f"Load package {package}")
    for name, spec in get_pkg_msg_specs(package)[0]:
        register(name, spec)


def load_package_dependencies(package: str, load_recursive: bool = False) -> None:
    """Register all messages of a package's direct dependencies.

    If `load_recursive` is true, include indirect dependencies.

    Raises:
        rospkg.ResourceNotFound: the package does not exist.
    """
    from rospkg import RosPack

    _say(f"Load dependencies for package {package}")
    packages = RosPack()
    known = set(packages.list())
    for name in packages.get_depends(package, implicit=load_recursive):
        if name in known:
            load_package(name)
