"""`roslib.srvs`, for legacy scripts: service definitions by package. New code uses `genmsg`."""

from __future__ import annotations

from pathlib import Path

import genmsg.srvs
from pipros.basics.lazy_names import star_names as _star_names
from pipros.msg.language.parse import parse_service
from pipros.msg.language.spec import DefinitionError
from roslib import msgs
from roslib.msgs import MsgSpec, MsgSpecException
from roslib.packages import resource_file
from roslib.resources import list_package_resources

_star_names(__name__, "os roslib io:StringIO sys")

SEP = "/"
EXT = ".srv"
COMMENTCHAR = "#"
IODELIM = "---"
VERBOSE = False

_verbose = [VERBOSE]


class SrvSpecException(Exception):
    """A definition is invalid. pipros never raises this error; legacy scripts catch it."""


def is_verbose() -> bool:
    """Return whether verbose output is enabled."""
    return _verbose[0]


def set_verbose(v: bool) -> None:
    """Enable or disable verbose output."""
    _verbose[0] = v


class SrvSpec(genmsg.srvs.SrvSpec):
    """A service definition, which consists of a request and a response."""

    request: MsgSpec
    response: MsgSpec

    def __init__(
        self,
        request: MsgSpec,
        response: MsgSpec,
        text: str,
        full_name: str = "",
        short_name: str = "",
        package: str = "",
    ) -> None:
        super().__init__(request, response, text, full_name)
        self.short_name = short_name
        self.package = package


def srv_file(package: str, type_: str) -> str:
    """Return the path of a service's definition. The file does not need to exist.

    Raises:
        InvalidROSPkgException: the package does not exist.
    """
    return resource_file(package, "srv", type_ + EXT)


def list_srv_types(package: str, include_depends: bool) -> list[str]:
    """Return the names of a package's services.

    If `include_depends` is true, include the services of the package's dependencies.

    Raises:
        InvalidROSPkgException: the package does not exist.
    """
    files = list_package_resources(package, include_depends, "srv", lambda file: file.endswith(EXT))
    return [name.removesuffix(EXT) for name in files]


def load_from_string(
    text: str, package_context: str = "", full_name: str = "", short_name: str = ""
) -> SrvSpec:
    """Parse a definition. Without a `---` line, it is a request, and the response is empty.

    Raises:
        roslib.msgs.MsgSpecException: the definition is invalid.
    """
    try:
        parsed = parse_service(text, msgs.type_name_of(full_name))
    except DefinitionError as error:
        raise MsgSpecException(str(error)) from error
    request, response = (
        msgs.load_from_string(half.text, package_context, f"{full_name}{suffix}", f"{short_name}{suffix}")
        for half, suffix in ((parsed.request, "Request"), (parsed.response, "Response"))
    )
    return SrvSpec(request, response, text, full_name, short_name, package_context)


def load_from_file(file_name: str, package_context: str = "") -> tuple[str, SrvSpec]:
    """Read a definition file. Return its name, qualified if the package is given, and the definition.

    Raises:
        OSError: the file cannot be read.
        roslib.msgs.MsgSpecException: the definition is invalid.
    """
    if is_verbose():
        print(f"Load spec from {file_name}")
    full_name, short_name, package = msgs.names_of_file(file_name, package_context, EXT)
    return full_name, load_from_string(Path(file_name).read_text("utf-8"), package, full_name, short_name)


def get_pkg_srv_specs(package: str) -> tuple[list[tuple[str, SrvSpec]], list[str]]:
    """Return `(name, definition)` for each service in a package, and the names of unreadable services."""
    found, failed = [], []
    for name in list_srv_types(package, False):
        try:
            found.append(load_from_file(srv_file(package, name), package))
        except (OSError, MsgSpecException) as error:
            print(f"ERROR: unable to load {name}: {error}")
            failed.append(name)
    return found, failed
