"""`genmsg.msg_loader`: loads definitions from files on a search path, `{package: [folders]}`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from genmsg.base import COMMENTCHAR as COMMENTCHAR
from genmsg.base import CONSTCHAR as CONSTCHAR
from genmsg.base import EXT_MSG as EXT_MSG
from genmsg.base import EXT_SRV as EXT_SRV
from genmsg.base import IODELIM as IODELIM
from genmsg.base import SEP as SEP
from genmsg.base import InvalidMsgSpec as InvalidMsgSpec
from genmsg.base import log as log
from genmsg.msgs import DURATION as DURATION
from genmsg.msgs import DURATION_MSG as DURATION_MSG
from genmsg.msgs import HEADER as HEADER
from genmsg.msgs import HEADER_FULL_NAME as HEADER_FULL_NAME
from genmsg.msgs import TIME as TIME
from genmsg.msgs import TIME_MSG as TIME_MSG
from genmsg.msgs import Constant as Constant
from genmsg.msgs import Field as Field
from genmsg.msgs import MsgSpec as MsgSpec
from genmsg.msgs import bare_msg_type as bare_msg_type
from genmsg.msgs import is_builtin as is_builtin
from genmsg.msgs import is_valid_constant_type as is_valid_constant_type
from genmsg.msgs import is_valid_msg_field_name as is_valid_msg_field_name
from genmsg.msgs import is_valid_msg_type as is_valid_msg_type
from genmsg.msgs import resolve_type as resolve_type
from genmsg.names import normalize_package_context as normalize_package_context
from genmsg.names import package_resource_name as package_resource_name
from genmsg.srvs import SrvSpec as SrvSpec
from pipros.basics.input_file import read_text
from pipros.msg.language.parse import constant_value, parse_message, parse_service
from pipros.msg.language.spec import DefinitionError

SearchPath = Mapping[str, Sequence[str]]
Parsed = TypeVar("Parsed")


class MsgNotFound(Exception):  # genmsg uses this name
    """The type is not on the search path."""

    def __init__(
        self,
        message: str,
        base_type: str | None = None,
        package: str | None = None,
        search_path: SearchPath | None = None,
    ) -> None:
        super().__init__(message)
        self.base_type = base_type
        self.package = package
        self.search_path = search_path


class MsgContext:
    """Loaded definitions, and the types that they embed."""

    def __init__(self) -> None:
        self._registered: dict[str, MsgSpec] = {}
        self._files: dict[str, str] = {}
        self._depends: dict[str, list[str]] = {}

    @staticmethod
    def create_default() -> MsgContext:
        """Return a context in which `time` and `duration` are registered."""
        context = MsgContext()
        for name, text in ((TIME, TIME_MSG), (DURATION, DURATION_MSG)):
            kind = text.partition(" ")[0]
            context.register(name, MsgSpec([kind, kind], ["secs", "nsecs"], [], text, name))
        return context

    def register(self, full_msg_type: str, msgspec: MsgSpec) -> None:
        self._registered[bare_msg_type(full_msg_type)] = msgspec

    def is_registered(self, full_msg_type: str) -> bool:
        return bare_msg_type(full_msg_type) in self._registered

    def get_registered(self, full_msg_type: str) -> MsgSpec:
        """Return the definition of a type. Raises KeyError if the type is not registered."""
        return self._registered[bare_msg_type(full_msg_type)]

    def set_file(self, full_msg_type: str, file_path: str) -> None:
        self._files[full_msg_type] = file_path

    def get_file(self, full_msg_type: str) -> str | None:
        return self._files.get(full_msg_type)

    def set_depends(self, full_msg_type: str, dependencies: list[str]) -> None:
        self._depends[full_msg_type] = dependencies

    def get_depends(self, full_msg_type: str) -> list[str] | None:
        return self._depends.get(full_msg_type)

    def get_all_depends(self, full_msg_type: str) -> list[str]:
        """Return the types that a type embeds, directly or indirectly, in depth-first order.

        Raises:
            KeyError: the dependencies of a type are not loaded.
        """
        found: list[str] = []
        for name in self._depends[full_msg_type]:
            found += [name, *self.get_all_depends(name)]
        return found

    def __str__(self) -> str:
        return str(self._registered)


def get_msg_file(package: str, base_type: str, search_path: SearchPath, ext: str = EXT_MSG) -> str:
    """Return the path of a type's definition file.

    Raises:
        MsgNotFound: the package or the type is not on the search path.
        ValueError: the search path is not a dictionary.
    """
    _check_search_path(search_path)
    if package not in search_path:
        problem = f"unknown package [{package}] on search path [{search_path}]"
        raise MsgNotFound(f"Cannot locate message [{base_type}]: {problem}", base_type, package, search_path)
    for folder in search_path[package]:
        file = Path(folder) / f"{base_type}{ext}"
        if file.is_file():
            return str(file)
    problem = f"with paths [{search_path[package]}]"
    raise MsgNotFound(
        f"Cannot locate message [{base_type}] in package [{package}] {problem}",
        base_type,
        package,
        search_path,
    )


def get_srv_file(package: str, base_type: str, search_path: SearchPath) -> str:
    return get_msg_file(package, base_type, search_path, ext=EXT_SRV)


def convert_constant_value(field_type: str, val: str) -> bool | int | float | str:
    """Convert the text of a constant to its value.

    Raises:
        InvalidMsgSpec: the value is out of bounds, or the type is not allowed for constants.
        ValueError: the text is not a valid value of the type.
    """
    if not is_valid_constant_type(field_type):
        raise InvalidMsgSpec(f"invalid constant type: [{field_type}]")
    if field_type == "bool":
        from ast import literal_eval

        return bool(literal_eval(val))
    if field_type == "string":
        return val.strip()
    if field_type.startswith("float"):
        return float(val)
    value = int(val)
    try:
        return constant_value(field_type, val)
    except ValueError:
        raise InvalidMsgSpec(f"cannot coerce [{value}] to {field_type} (out of bounds)") from None


def load_msg_from_string(msg_context: MsgContext, text: str, full_name: str) -> MsgSpec:
    """Parse and register a definition.

    Raises:
        InvalidMsgSpec: the definition is invalid.
    """
    spec = MsgSpec.of(_parsed(parse_message, text, full_name))
    msg_context.register(full_name, spec)
    return spec


def load_msg_from_file(msg_context: MsgContext, file_path: str, full_name: str) -> MsgSpec:
    spec = MsgSpec.of(_parsed(parse_message, read_text(file_path), full_name, file_path))
    msg_context.register(full_name, spec)
    msg_context.set_file(full_name, file_path)
    return spec


def load_msg_by_type(msg_context: MsgContext, msg_type: str, search_path: SearchPath) -> MsgSpec:
    """Find, parse and register a definition.

    Raises:
        MsgNotFound: the type is not on the search path.
        InvalidMsgSpec: the definition is invalid.
    """
    _check_search_path(search_path)
    full_name = HEADER_FULL_NAME if msg_type == HEADER else msg_type
    package, base_type = package_resource_name(full_name)
    return load_msg_from_file(msg_context, get_msg_file(package, base_type, search_path), full_name)


def load_srv_from_string(msg_context: MsgContext, text: str, full_name: str) -> SrvSpec:
    return _registered(msg_context, SrvSpec.of(_parsed(parse_service, text, full_name)))


def load_srv_from_file(msg_context: MsgContext, file_path: str, full_name: str) -> SrvSpec:
    text = read_text(file_path)
    spec = _registered(msg_context, SrvSpec.of(_parsed(parse_service, text, full_name, file_path)))
    msg_context.set_file(f"{full_name}Request", file_path)
    msg_context.set_file(f"{full_name}Response", file_path)
    return spec


def load_srv_by_type(msg_context: MsgContext, srv_type: str, search_path: SearchPath) -> SrvSpec:
    """Find, parse and register the definition of a service; see `load_msg_by_type`."""
    package, base_type = package_resource_name(srv_type)
    return load_srv_from_file(msg_context, get_srv_file(package, base_type, search_path), srv_type)


def load_msg_depends(msg_context: MsgContext, spec: MsgSpec, search_path: SearchPath) -> list[str]:
    """Load all types that a message embeds, directly or indirectly.

    Returns:
        The directly embedded types.
    """
    depends = [name for name in map(bare_msg_type, spec.types) if not is_builtin(name)]
    for name in depends:
        if not msg_context.is_registered(name):
            load_msg_by_type(msg_context, name, search_path)
    msg_context.set_depends(spec.full_name, depends)
    for name in depends:
        if msg_context.get_depends(name) is None:
            load_msg_depends(msg_context, msg_context.get_registered(name), search_path)
    return depends


def load_depends(msg_context: MsgContext, spec: MsgSpec | SrvSpec, msg_search_path: SearchPath) -> list[str]:
    """Load all types that a message or a service embeds; see `load_msg_depends`.

    Raises:
        ValueError: `spec` is neither a message nor a service.
    """
    if not isinstance(spec, (MsgSpec, SrvSpec)):
        raise ValueError("spec does not appear to be a message or service")  # as in genmsg
    if isinstance(spec, SrvSpec):
        return [
            *load_msg_depends(msg_context, spec.request, msg_search_path),
            *load_msg_depends(msg_context, spec.response, msg_search_path),
        ]
    return load_msg_depends(msg_context, spec, msg_search_path)


def _check_search_path(search_path: object) -> None:
    if not isinstance(search_path, dict):
        raise ValueError("search_path must be a dictionary of {namespace: dirpath}")  # as in genmsg


def _registered(msg_context: MsgContext, spec: SrvSpec) -> SrvSpec:
    for half in (spec.request, spec.response):
        msg_context.register(half.full_name, half)
    return spec


def _parsed(
    parse: Callable[[str, str, str | None], Parsed], text: str, full_name: str, file: str | None = None
) -> Parsed:
    try:
        return parse(text, full_name, file)
    except DefinitionError as error:
        raise InvalidMsgSpec(str(error)) from error
