"""The options of `catkin_make` that concern the build."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True, slots=True)
class BuildOptions:
    """The options of a build.

    Attributes:
        only: names of packages to build with all that they depend on; empty for all.
        left_out: names of packages to leave out.
        definitions: the `-D` settings.
        installs: whether to write the install space, too.
        tests: whether tests will be run; compiled ones are then built.
        jobs: arguments for make, for packages with compiled code.
        targets: custom targets to run besides those of `all`.
        is_alone: whether to build the packages in `only` without those that they depend on. Packages for
            genuine catkin are then named in the result, not built, unless they are in `genuine`.
        genuine: packages that genuine catkin builds, whatever their code, with `is_alone`.
        sources: the source folders that the devel space lists; empty for that of the workspace.
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
