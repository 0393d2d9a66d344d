"""`roslib.srvs`, for legacy scripts: service definitions by package. New code uses `genmsg`."""

from __future__ import annotations

import os
from pathlib import Path

from pipros.basics.lazy_names import star_names as _star_names
from pipros.msg.language.parse import parse_service
from pipros.msg.language.spec import DefinitionError
from roslib import msgs
from roslib.msgs import MsgSpec, MsgSpecException
from roslib.packages import resource_file
from roslib.resources import list_package_resources

_star_names(__name__, "roslib io:StringIO sys")

SEP = "/"
EXT = ".srv"
COMMENTCHAR = "#"
IODELIM = "---"
VERBOSE = False

_verbose = [VERBOSE]


class SrvSpecException(Exception):
    """A definition is invalid. pipros never raises it; legacy scripts catch it."""


def is_verbose() -> bool:
    """Return whether functions print their actions."""
    return _verbose[0]


def set_verbose(v: bool) -> None:
    """Set whether functions print their actions."""
    _verbose[0] = v


class SrvSpec:
    """A service definition: request and response."""

    def __init__(
        self,
        request: MsgSpec,
        response: MsgSpec,
        text: str,
        full_name: str = "",
        short_name: str = "",
        package: str = "",
    ) -> None:
        self.request = request
        self.response = response
        self.text = text
        self.full_name = full_name
        self.short_name = short_name
        self.package = package

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, SrvSpec):
            return False
        mine = (self.request, self.response, self.text, self.full_name, self.short_name, self.package)
        theirs = (other.full_name, other.short_name, other.package)
        return mine == (other.request, other.response, other.text, *theirs)

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"SrvSpec[{self.request!r}, {self.response!r}]"


def srv_file(package: str, type_: str) -> str:
    """Return the path of a service's definition; the file need not exist.

    Raises:
        InvalidROSPkgException: the package does not exist.
    """
    return resource_file(package, "srv", type_ + EXT)


def list_srv_types(package: str, include_depends: bool) -> list[str]:
    """Return the names of a package's services.

    If `include_depends` is true, include the services of its dependencies.

    Raises:
        InvalidROSPkgException: the package does not exist.
    """
    files = list_package_resources(package, include_depends, "srv", lambda file: file.endswith(EXT))
    return [name.removesuffix(EXT) for name in files]


def load_from_string(
    text: str, package_context: str = "", full_name: str = "", short_name: str = ""
) -> SrvSpec:
    """Parse a definition; without `---` it is a request with an empty response.

    Raises:
        roslib.msgs.MsgSpecException: the definition is invalid.
    """
    named = full_name if full_name.count(SEP) == 1 and all(full_name.split(SEP)) else "text/Text"
    try:
        parsed = parse_service(text, named)
    except DefinitionError as error:
        raise MsgSpecException(str(error)) from error
    request, response = (
        msgs.load_from_string(half.text, package_context, f"{full_name}{suffix}", f"{short_name}{suffix}")
        for half, suffix in ((parsed.request, "Request"), (parsed.response, "Response"))
    )
    return SrvSpec(request, response, text, full_name, short_name, package_context)


def load_from_file(file_name: str, package_context: str = "") -> tuple[str, SrvSpec]:
    """Read a definition file; return its name, qualified if the package is given, and the definition.

    Raises:
        OSError: the file cannot be read.
        roslib.msgs.MsgSpecException: the definition is invalid.
    """
    if is_verbose():
        print(f"Load spec from {file_name}")
    short_name = os.path.basename(file_name).removesuffix(EXT)
    package = package_context.rstrip(SEP)
    full_name = f"{package}{SEP}{short_name}" if package else short_name
    return full_name, load_from_string(Path(file_name).read_text("utf-8"), package, full_name, short_name)


def get_pkg_srv_specs(package: str) -> tuple[list[tuple[str, SrvSpec]], list[str]]:
    """Return `(name, definition)` of each service of a package, and the names of unreadable ones."""
    found, failed = [], []
    for name in list_srv_types(package, False):
        try:
            found.append(load_from_file(srv_file(package, name), package))
        except (OSError, MsgSpecException) as error:
            print(f"ERROR: unable to load {name}: {error}")
            failed.append(name)
    return found, failed
