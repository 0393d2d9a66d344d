"""What `catkin_make` is asked to build, and how."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class BuildOptions:
    """What the command line asks for.

    Attributes:
        only: names of packages to build with all that they need; empty for all.
        left_out: names of packages to leave out.
        definitions: the `-D` settings.
        installs: whether to fill the install space, too.
        tests: whether tests will be run, for which something may have to be compiled.
        jobs: arguments for make, for packages that need it.
        targets: custom targets to run besides those that are always run.
    """

    only: frozenset[str] = frozenset()
    left_out: frozenset[str] = frozenset()
    definitions: Mapping[str, str] = field(default_factory=dict)
    installs: bool = False
    tests: bool = False
    jobs: tuple[str, ...] = ()
    targets: tuple[str, ...] = ()
