"""Options for building a workspace."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True, slots=True)
class BuildOptions:
    """Options for a build.

    Attributes:
        only: names of the packages to build, along with their dependencies; empty for all packages.
        left_out: names of packages to skip.
        definitions: the CMake variables set with `-D`, by name.
        installs: whether to also write the install space.
        tests: whether tests will be run. If so, compiled tests are built.
        jobs: arguments for make, which builds the packages with compiled code.
        targets: custom targets to run in addition to `all`.
        is_alone: whether to build the packages in `only` without their dependencies. Packages that need
            genuine catkin are then not built but listed in the result, unless they are in `genuine`.
        genuine: the packages that genuine catkin builds even if they have no compiled code.
        sources: the source folders to list in the devel space; empty for the workspace's source space.
    """

    only: frozenset[str] = frozenset()
    left_out: frozenset[str] = frozenset()
    definitions: Mapping[str, str] = field(default_factory=dict)
    installs: bool = False
    tests: bool = False
    jobs: tuple[str, ...] = ()
    targets: tuple[str, ...] = ()
    is_alone: bool = False
    genuine: frozenset[str] = frozenset()
    sources: tuple[Path, ...] = ()
