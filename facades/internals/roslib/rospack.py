"""`roslib.rospack`, for old scripts: the commands `rospack` and `rosstack`."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "roslib rospkg sys warnings")

python3 = True


def rospackexec(args: Sequence[str]) -> str:
    """What `rospack` prints with these arguments; nothing when it fails."""
    return _printed("rospack", args)


def rosstackexec(args: Sequence[str]) -> str:
    """What `rosstack` prints with these arguments; nothing when it fails."""
    return _printed("rosstack", args)


def _printed(command: str, args: Sequence[str]) -> str:
    ran = subprocess.run([command, *args], stdout=subprocess.PIPE, text=True, check=False)  # noqa: S603
    return ran.stdout.strip()


def rospack_depends_1(pkg: str) -> list[str]:
    """The packages that one needs itself."""
    return rospackexec(["depends1", pkg]).split()


def rospack_depends(pkg: str) -> list[str]:
    """The packages that one needs, and those that they need."""
    return rospackexec(["depends", pkg]).split()


def rospack_depends_on_1(pkg: str) -> list[str]:
    """The packages that need one themselves."""
    return rospackexec(["depends-on1", pkg]).split()


def rospack_depends_on(pkg: str) -> list[str]:
    """The packages that need one, and those that need them."""
    return rospackexec(["depends-on", pkg]).split()


def rospack_plugins(pkg: str) -> list[tuple[str, str]]:
    """`(package, value)` of what other packages export for one as `plugin`."""
    lines = rospackexec(["plugins", "--attrib=plugin", pkg]).splitlines()
    return [(name, value) for name, _, value in (line.partition(" ") for line in lines)]


def rosstack_depends_1(s: str) -> list[str]:
    """The stacks that one needs itself."""
    return rosstackexec(["depends1", s]).split()


def rosstack_depends(s: str) -> list[str]:
    """The stacks that one needs, and those that they need."""
    return rosstackexec(["depends", s]).split()


def rosstack_depends_on_1(s: str) -> list[str]:
    """The stacks that need one themselves."""
    return rosstackexec(["depends-on1", s]).split()


def rosstack_depends_on(s: str) -> list[str]:
    """The stacks that need one, and those that need them."""
    return rosstackexec(["depends-on", s]).split()
