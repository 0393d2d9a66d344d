"""`roslib.rospack`, for legacy scripts: the commands `rospack` and `rosstack`."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence

python3 = True


def rospackexec(args: Sequence[str]) -> str:
    """Return the output of `rospack` with the given arguments, or an empty string on failure."""
    return _printed("rospack", args)


def rosstackexec(args: Sequence[str]) -> str:
    """Return the output of `rosstack` with the given arguments, or an empty string on failure."""
    return _printed("rosstack", args)


def _printed(command: str, args: Sequence[str]) -> str:
    ran = subprocess.run([command, *args], stdout=subprocess.PIPE, text=True, check=False)  # noqa: S603
    return ran.stdout.strip()


def rospack_depends_1(pkg: str) -> list[str]:
    """Return the direct dependencies of a package."""
    return rospackexec(["depends1", pkg]).split()


def rospack_depends(pkg: str) -> list[str]:
    """Return the direct and indirect dependencies of a package."""
    return rospackexec(["depends", pkg]).split()


def rospack_depends_on_1(pkg: str) -> list[str]:
    """Return the packages that depend on a package directly."""
    return rospackexec(["depends-on1", pkg]).split()


def rospack_depends_on(pkg: str) -> list[str]:
    """Return the packages that depend on a package directly or indirectly."""
    return rospackexec(["depends-on", pkg]).split()


def rospack_plugins(pkg: str) -> list[tuple[str, str]]:
    """Return `(package, value)` for each package that exports a `plugin` attribute for the given package."""
    lines = rospackexec(["plugins", "--attrib=plugin", pkg]).splitlines()
    return [(name, value) for name, _, value in (line.partition(" ") for line in lines)]


def rosstack_depends_1(s: str) -> list[str]:
    """Return the direct dependencies of a stack."""
    return rosstackexec(["depends1", s]).split()


def rosstack_depends(s: str) -> list[str]:
    """Return the direct and indirect dependencies of a stack."""
    return rosstackexec(["depends", s]).split()


def rosstack_depends_on_1(s: str) -> list[str]:
    """Return the stacks that depend on a stack directly."""
    return rosstackexec(["depends-on1", s]).split()


def rosstack_depends_on(s: str) -> list[str]:
    """Return the stacks that depend on a stack directly or indirectly."""
    return rosstackexec(["depends-on", s]).split()
