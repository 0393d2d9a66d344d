"""`rosmsg` for Python code: the types of packages, and their definitions as text.

Facade of `pipros.cli.rosmsg`; see http://wiki.ros.org/rosmsg. Where Noetic takes a `rospkg.RosPack`,
the packages of the environment are meant.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping

from pipros.cli.rosmsg import main as _main
from pipros.errors import PiprosError
from pipros.workspace.index import PackageIndex
from pipros.workspace.type_catalogue import MESSAGES, SERVICES, TypeCatalogue

__all__ = [
    "MODE_MSG",
    "MODE_SRV",
    "ROSMsgException",
    "get_msg_text",
    "get_srv_text",
    "iterate_packages",
    "list_msgs",
    "list_srvs",
    "list_types",
    "rosmsg_md5",
    "rosmsg_search",
    "rosmsgmain",
]

MODE_MSG = ".msg"
MODE_SRV = ".srv"

_KINDS: Mapping[str, TypeCatalogue] = {MODE_MSG: MESSAGES, MODE_SRV: SERVICES}


class ROSMsgException(Exception):
    """A type or a package is not there, or its definition is broken."""


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
    try:
        return [f"{package}/{name}" for name in _KINDS[mode].names(package)]
    except PiprosError as error:
        raise ROSMsgException(str(error)) from None


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


def rosmsgmain(mode: str = MODE_MSG) -> None:
    """The command `rosmsg` or `rossrv`; ends the process."""
    sys.exit(_main(interfaces=_KINDS[mode]))
