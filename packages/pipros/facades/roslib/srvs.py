"""`roslib.srvs`, for legacy scripts: reads service definitions with `genmsg`."""

from __future__ import annotations

import os

import genmsg.msg_loader
from genmsg.base import InvalidMsgSpec
from genmsg.msgs import MsgSpec as MsgSpec
from genmsg.srvs import SrvSpec as SrvSpec
from pipros.basics.input_file import read_text
from roslib.msgs import MsgSpecException
from roslib.packages import resource_file
from roslib.resources import list_package_resources

SEP = "/"
EXT = ".srv"
COMMENTCHAR = "#"
IODELIM = "---"
VERBOSE = False


class SrvSpecException(Exception):
    """A service definition is invalid."""


def srv_file(package: str, type_: str) -> str:
    """Return the path of a package's definition, even if it does not exist."""
    return resource_file(package, "srv", type_ + EXT)


def list_srv_types(package: str, include_depends: bool) -> list[str]:
    """Return the names of a package's services."""
    files = list_package_resources(package, include_depends, "srv", lambda file: file.endswith(EXT))
    return [file.removesuffix(EXT) for file in files]


def get_pkg_srv_specs(package: str) -> tuple[list[tuple[str, SrvSpec]], list[str]]:
    """Return the names and definitions of a package's services, and the files that cannot be read."""
    found, failed = [], []
    for name in list_srv_types(package, False):
        file = srv_file(package, name)
        try:
            found.append(load_from_file(file, package))
        except (MsgSpecException, OSError):
            failed.append(file)
    return found, failed


def load_from_file(file_name: str, package_context: str = "") -> tuple[str, SrvSpec]:
    """Return the name and the definition of the service in a file.

    Types without a package belong to `package_context`.

    Raises:
        MsgSpecException: the definition is invalid.
    """
    short = os.path.basename(file_name).removesuffix(EXT)
    name = f"{package_context}{SEP}{short}" if package_context else short
    return name, load_from_string(read_text(file_name), package_context, name, short)


def load_from_string(
    text: str, package_context: str = "", full_name: str = "", short_name: str = ""
) -> SrvSpec:
    """Return the definition of a service; see `load_from_file`."""
    context = genmsg.msg_loader.MsgContext.create_default()
    complete = text if IODELIM in text else f"{text}\n{IODELIM}\n"
    try:
        spec = genmsg.msg_loader.load_srv_from_string(
            context, complete, f"{package_context or 'unknown'}{SEP}{short_name or 'Unnamed'}"
        )
    except InvalidMsgSpec as error:
        raise MsgSpecException(str(error)) from None
    spec.text, spec.full_name, spec.short_name, spec.package = text, full_name, short_name, package_context
    _rename(spec.request, spec, "Request")
    _rename(spec.response, spec, "Response")
    return spec


def _rename(half: MsgSpec, spec: SrvSpec, suffix: str) -> None:
    half.full_name = f"{spec.full_name}{suffix}" if spec.full_name else ""
    half.short_name = f"{spec.short_name}{suffix}" if spec.short_name else ""
    half.package = spec.package
