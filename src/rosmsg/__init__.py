"""`rosmsg` for Python code: the types of packages, and their definitions as text.

Facade of `pipros.cli.rosmsg`; see http://wiki.ros.org/rosmsg. Where Noetic takes a `rospkg.RosPack`,
the packages of the environment are meant.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

from genpy.dynamic import generate_dynamic
from pipros.cli.rosmsg import main as _main
from pipros.cli.rosmsg_proto import main as _prototype_main
from pipros.errors import PiprosError
from pipros.graph.skeleton import skeleton
from pipros.lazy_names import star_names as _star_names
from pipros.msg import load_message_class
from pipros.msg.base import Message
from pipros.msg.language.spec import BUILTINS
from pipros.workspace.find_in_workspaces import find_in_workspaces
from pipros.workspace.index import PackageIndex
from pipros.workspace.type_catalogue import MESSAGES, SERVICES, TypeCatalogue

__all__ = [
    "MAX_DEFAULT_NON_FLOW_ITEMS",
    "MODE_MSG",
    "MODE_SRV",
    "ROSMsgException",
    "RosMsgProtoArgsException",
    "RosMsgProtoException",
    "create_names_filter",
    "find_in_workspaces",
    "fullusage",
    "generate_dynamic",
    "get_array_type_instance",
    "get_msg_text",
    "get_srv_text",
    "get_yaml_for_msg",
    "iterate_packages",
    "list_msgs",
    "list_srvs",
    "list_types",
    "rosmsg_cmd_list",
    "rosmsg_cmd_md5",
    "rosmsg_cmd_package",
    "rosmsg_cmd_packages",
    "rosmsg_cmd_prototype",
    "rosmsg_cmd_show",
    "rosmsg_debug",
    "rosmsg_md5",
    "rosmsg_search",
    "rosmsgmain",
    "spec_to_str",
]

_star_names(
    __name__,
    "collections genmsg inspect optparse:OptionParser os roslib rospkg io:StringIO sys yaml",
)

MAX_DEFAULT_NON_FLOW_ITEMS = 4

MODE_MSG = ".msg"
MODE_SRV = ".srv"

_KINDS: Mapping[str, TypeCatalogue] = {MODE_MSG: MESSAGES, MODE_SRV: SERVICES}


class ROSMsgException(Exception):
    """A type or a package is not there, or its definition is broken."""


class RosMsgProtoException(Exception):
    """A message cannot be shown as YAML."""


class RosMsgProtoArgsException(Exception):
    """The arguments of `rosmsg-proto` are wrong."""


def get_msg_text(type_: str, raw: bool = False, rospack: object = None) -> str:  # noqa: ARG001
    """The definition of a message: as written, or with what it embeds.

    Raises:
        ROSMsgException: it cannot be had.
    """
    return _text(MESSAGES, type_, raw)


def get_srv_text(type_: str, raw: bool = False, rospack: object = None) -> str:  # noqa: ARG001
    """The definition of a service, as `get_msg_text`."""
    return _text(SERVICES, type_, raw)


def _text(interfaces: TypeCatalogue, type_name: str, raw: bool) -> str:
    try:
        return interfaces.text(type_name, is_raw=raw)
    except PiprosError as error:
        raise ROSMsgException(f"{interfaces.unknown} [{type_name}]: {error}") from None


def list_types(package: str, mode: str = MODE_MSG, rospack: object = None) -> list[str]:  # noqa: ARG001
    """The types of a package, `package/Name` each, sorted.

    Raises:
        ROSMsgException: the package does not exist.
    """
    if mode not in _KINDS:
        raise ValueError(f"Unknown mode for list_types: {mode}")
    try:
        return [f"{package}/{name}" for name in _KINDS[mode].names(package)]
    except PiprosError as error:
        raise ROSMsgException(str(error)) from None


def _list_types(path: str, subdir: str, ext: str) -> list[str]:
    """The names of the types whose files, with the extension `ext`, are in the folder `path`, sorted."""
    del subdir  # stands in the path
    return sorted(file.stem for file in Path(path).glob(f"*{ext}") if file.is_file())


def list_msgs(package: str, rospack: object = None) -> list[str]:
    """The messages of a package, `package/Name` each, sorted."""
    return list_types(package, MODE_MSG, rospack)


def list_srvs(package: str, rospack: object = None) -> list[str]:
    """The services of a package, `package/Name` each, sorted."""
    return list_types(package, MODE_SRV, rospack)


def iterate_packages(rospack: object, mode: str) -> Iterator[tuple[str, str]]:  # noqa: ARG001
    """The packages that have messages (or services), each with the folder that holds them."""
    interfaces = _KINDS[mode]
    index = PackageIndex.from_environment()
    for package in interfaces.packages():
        yield package, str(index.find(package).path / interfaces.kind)


def rosmsg_search(rospack: object, mode: str, base_type: str) -> Iterator[str]:  # noqa: ARG001
    """The types of that name in all packages."""
    yield from _KINDS[mode].types_named(base_type)


def rosmsg_md5(mode: str, type_: str) -> str:
    """The md5 of a type.

    Raises:
        ROSMsgException: the type does not exist.
    """
    try:
        return _KINDS[mode].md5(type_)
    except PiprosError as error:
        raise ROSMsgException(str(error)) from None


def rosmsg_debug(rospack: object, mode: str, type_: str, raw: bool = False) -> None:  # noqa: ARG001
    """Prints the definition of a type. Raises as `get_msg_text`."""
    print(_text(_KINDS[mode], type_, raw))


def spec_to_str(msg_context: Any, spec: Any, buff: TextIO | None = None, indent: str = "") -> str:
    """The constants and fields of a definition of genmsg, those of embedded types below theirs.

    Args:
        msg_context: a `genmsg.MsgContext` with the embedded types.
        spec: a `genmsg.MsgSpec`.
        buff: where to write it, too.

    Raises:
        KeyError: an embedded type is not registered.
    """
    lines = [f"{indent}{constant.type} {constant.name}={constant.val_text}\n" for constant in spec.constants]
    for field in spec.parsed_fields():
        lines.append(f"{indent}{field.type} {field.name}\n")
        if not field.is_builtin:
            lines.append(
                spec_to_str(msg_context, msg_context.get_registered(field.base_type), indent=indent + "  ")
            )
    text = "".join(lines)
    if buff is not None:
        buff.write(text)
    return text


def create_names_filter(names: Collection[str]) -> Callable[[Any], list[str]]:
    """What lists the fields of a message that are not among these."""
    return lambda message: [name for name in message.__slots__ if name not in names]


def get_array_type_instance(field_type: str, default_package: str | None = None) -> Any:
    """The default value of an element of an array: `get_array_type_instance("int32[]")` is 0.

    None for an array of texts, and for a type that does not exist.
    """
    base = field_type.partition("[")[0].strip()
    if base in ("time", "duration"):
        base = "std_msgs/" + base.capitalize()
    elif base == "Header":
        base = "std_msgs/Header"
    elif base in BUILTINS:
        return False if base == "bool" else None if base == "string" else 0
    elif "/" not in base:
        base = f"{default_package or ''}/{base}"
    try:
        return load_message_class(base)()
    except PiprosError:
        return None


def get_yaml_for_msg(
    msg: Message,
    prefix: str = "",
    time_offset: Any = None,
    current_time: Any = None,
    field_filter: Callable[[Any], Collection[str]] | None = None,
    flow_style_: bool | None = None,
    fill_arrays_: bool = False,
) -> str:
    """The fields of a message as YAML.

    Args:
        prefix: put before each line.
        field_filter: lists the fields to show of a message.
        flow_style_: with brackets always, never, or (None) for the parts of larger messages.
        fill_arrays_: shows one element of arrays that would be empty.
    """
    del time_offset, current_time
    shown = msg.__slots__ if field_filter is None else field_filter(msg)
    left_out = [name for name in msg.__slots__ if name not in shown]
    text = skeleton(msg, flow_style_, left_out, fill_arrays=fill_arrays_)
    return "\n".join(prefix + line for line in text.splitlines())


def fullusage(mode: str) -> str:
    """What the command prints without arguments: how to use it."""
    from contextlib import redirect_stdout
    from io import StringIO

    with redirect_stdout(StringIO()) as printed:
        _main([], interfaces=_KINDS[mode])
    return printed.getvalue().rstrip("\n") + "\n"


def rosmsg_cmd_list(mode: str, full: str, argv: Sequence[str] | None = None) -> None:
    """`rosmsg list`, with the arguments behind it."""
    _command(mode, full, "list", argv)


def rosmsg_cmd_packages(mode: str, full: str, argv: Sequence[str] | None = None) -> None:
    """`rosmsg packages`, with the arguments behind it."""
    _command(mode, full, "packages", argv)


def rosmsg_cmd_show(mode: str, full: str, alias: str = "show") -> None:
    """`rosmsg show`, with the arguments of the process behind it."""
    _command(mode, full, alias, None)


def rosmsg_cmd_md5(mode: str, full: str) -> None:
    """`rosmsg md5`, with the arguments of the process behind it."""
    _command(mode, full, "md5", None)


def rosmsg_cmd_package(mode: str, full: str) -> None:
    """`rosmsg package`, with the arguments of the process behind it."""
    _command(mode, full, "package", None)


def rosmsg_cmd_prototype(args: Sequence[str]) -> None:
    """`rosmsg-proto`, with these arguments.

    Raises:
        SystemExit: it failed, or was used wrongly.
    """
    if code := _prototype_main(list(args)):
        sys.exit(code)


def _command(mode: str, full: str, name: str, argv: Sequence[str] | None) -> None:
    del full  # how the command calls itself
    arguments = sys.argv[2:] if argv is None else argv
    if code := _main([name, *arguments], interfaces=_KINDS[mode]):
        sys.exit(code)


def rosmsgmain(mode: str = MODE_MSG) -> None:
    """The command `rosmsg` or `rossrv`.

    Raises:
        SystemExit: it failed, or was used wrongly.
    """
    if code := _main(interfaces=_KINDS[mode]):
        sys.exit(code)
