"""Python API of `rosmsg` and `rossrv`: message and service types, and their definitions.

Facade of `pipros_tools.cli.rosmsg`; see http://wiki.ros.org/rosmsg. `rospack` arguments are ignored; packages
are found through the environment.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from genpy.dynamic import generate_dynamic
from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.msg.base import Message
from pipros.msg.language.spec import BUILTINS
from pipros_tools.cli.rosmsg import main as _main
from pipros_tools.cli.rosmsg_proto import main as _prototype_main
from pipros_tools.graph.skeleton import skeleton
from pipros_workspace.find_in_workspaces import find_in_workspaces
from pipros_workspace.index import PackageIndex
from pipros_workspace.type_catalogue import MESSAGES, SERVICES, TypeCatalogue

__all__ = [
    "MAX_DEFAULT_NON_FLOW_ITEMS",
    "MODE_MSG",
    "MODE_SRV",
    "ROSMsgException",
    "create_names_filter",
    "find_in_workspaces",
    "generate_dynamic",
    "get_array_type_instance",
    "get_msg_text",
    "get_srv_text",
    "get_yaml_for_msg",
    "iterate_packages",
    "list_msgs",
    "list_srvs",
    "list_types",
    "rosmsg_cmd_prototype",
    "rosmsg_md5",
    "rosmsg_search",
    "rosmsgmain",
]

MAX_DEFAULT_NON_FLOW_ITEMS = 4

MODE_MSG = ".msg"
MODE_SRV = ".srv"

_KINDS: Mapping[str, TypeCatalogue] = {MODE_MSG: MESSAGES, MODE_SRV: SERVICES}


class ROSMsgException(Exception):
    """A type or a package does not exist, or a definition is invalid."""


def get_msg_text(type_: str, raw: bool = False, rospack: object = None) -> str:  # noqa: ARG001
    """Return a message's definition. Unless `raw` is true, include the embedded types.

    Raises:
        ROSMsgException: the type does not exist, or its definition is invalid.
    """
    return _text(MESSAGES, type_, raw)


def get_srv_text(type_: str, raw: bool = False, rospack: object = None) -> str:  # noqa: ARG001
    """Return the definition of a service; see `get_msg_text`."""
    return _text(SERVICES, type_, raw)


def _text(interfaces: TypeCatalogue, type_name: str, raw: bool) -> str:
    try:
        return interfaces.text(type_name, is_raw=raw)
    except PiprosError as error:
        raise ROSMsgException(f"{interfaces.unknown} [{type_name}]: {error}") from None


def list_types(package: str, mode: str = MODE_MSG, rospack: object = None) -> list[str]:  # noqa: ARG001
    """Return the types in a package as `package/Name`, sorted.

    Raises:
        ROSMsgException: the package does not exist.
        ValueError: `mode` is unknown.
    """
    if mode not in _KINDS:
        raise ValueError(f"Unknown mode for list_types: {mode}")
    try:
        return [f"{package}/{name}" for name in _KINDS[mode].names(package)]
    except PiprosError as error:
        raise ROSMsgException(str(error)) from None


def _list_types(path: str, subdir: str, ext: str) -> list[str]:
    """Return the names of the types in the folder `path` with the file extension `ext`, sorted."""
    del subdir  # `subdir` is already part of the path
    return sorted(file.stem for file in Path(path).glob(f"*{ext}") if file.is_file())


def _get_package_paths(pkgname: str, rospack: Any) -> list[str]:
    """Return the folder of a package, and its folder in a built workspace if that is another.

    Raises:
        rospkg.ResourceNotFound: the package does not exist.
    """
    built = find_in_workspaces(search_dirs=["share"], project=pkgname, first_match_only=True)
    return list(dict.fromkeys([rospack.get_path(pkgname), *built]))


def list_msgs(package: str, rospack: object = None) -> list[str]:
    """Return the messages in a package as `package/Name`, sorted."""
    return list_types(package, MODE_MSG, rospack)


def list_srvs(package: str, rospack: object = None) -> list[str]:
    """Return the services in a package as `package/Name`, sorted."""
    return list_types(package, MODE_SRV, rospack)


def iterate_packages(rospack: object, mode: str) -> Iterator[tuple[str, str]]:  # noqa: ARG001
    """Yield each package that defines messages (or services), with the folder of its definitions."""
    interfaces = _KINDS[mode]
    index = PackageIndex.from_environment()
    for package in interfaces.packages():
        yield package, str(index.find(package).path / interfaces.kind)


def rosmsg_search(rospack: object, mode: str, base_type: str) -> Iterator[str]:  # noqa: ARG001
    """Yield the types named `base_type` in all packages."""
    yield from _KINDS[mode].types_named(base_type)


def rosmsg_md5(mode: str, type_: str) -> str:
    """Return the MD5 sum of a type.

    Raises:
        ROSMsgException: the type does not exist, or its definition is invalid.
    """
    try:
        return _KINDS[mode].md5(type_)
    except PiprosError as error:
        raise ROSMsgException(str(error)) from None


def create_names_filter(names: Collection[str]) -> Callable[[Any], list[str]]:
    """Return a function that lists the fields of a message except `names`."""
    return lambda message: [name for name in message.__slots__ if name not in names]


_ELEMENT_CLASSES = {"time": "std_msgs/Time", "duration": "std_msgs/Duration", "Header": "std_msgs/Header"}


def get_array_type_instance(field_type: str, default_package: str | None = None) -> Any:
    """Return the default value of an array element, such as 0 for `get_array_type_instance("int32[]")`.

    Return None for an array of strings, and for an unknown type.
    """
    base = field_type.partition("[")[0].strip()
    base = _ELEMENT_CLASSES.get(base, base)
    if base in BUILTINS:
        return {"bool": False, "string": None}.get(base, 0)
    if "/" not in base:
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
    """Return the fields of a message as YAML.

    Args:
        prefix: prefix of each line.
        field_filter: function that returns the names of the fields to include, given a message.
        flow_style_: whether to use flow style (brackets); None to use it only inside large messages.
        fill_arrays_: whether to represent empty arrays with one element.
    """
    del time_offset, current_time
    shown = msg.__slots__ if field_filter is None else field_filter(msg)
    left_out = [name for name in msg.__slots__ if name not in shown]
    text = skeleton(msg, flow_style_, left_out, fill_arrays=fill_arrays_)
    return "\n".join(prefix + line for line in text.splitlines())


def rosmsg_cmd_prototype(args: Sequence[str]) -> str | None:
    """Return the output of `rosmsg-proto` for the given arguments: an empty message as YAML.

    Return None if the message does not exist and the option `-s` is given.

    Raises:
        SystemExit: the type does not exist, or the arguments are invalid. The reason is on standard error.
    """
    from contextlib import redirect_stdout
    from io import StringIO

    with redirect_stdout(StringIO()) as printed:
        code = _prototype_main(list(args))
    if code:
        sys.exit(code)
    return printed.getvalue().removesuffix("\n") or None


def rosmsgmain(mode: str = MODE_MSG) -> None:
    """Run the command `rosmsg` or `rossrv`.

    Raises:
        SystemExit: the command failed, or its arguments are invalid.
    """
    if code := _main(interfaces=_KINDS[mode]):
        sys.exit(code)
