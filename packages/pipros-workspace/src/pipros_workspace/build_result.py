"""The outcome of a build."""

from __future__ import annotations

from dataclasses import dataclass, field

from pipros_workspace.catkin.project import Project


@dataclass(slots=True)
class BuildResult:
    """The outcome of a build.

    Attributes:
        built: names of the packages that were built, in build order.
        unchanged: names of packages that were up to date.
        errors: one error text per problem, starting with the package or file.
        skipped: packages that were skipped, each mapped to the failed package on which it depends. If such a
            package has compiled code, its other parts may have been built.
        projects: the parsed `CMakeLists.txt` of each package, by package name.
        needs_genuine: packages that only genuine catkin can build, except those in `BuildOptions.genuine`. If
            there are any, nothing was built. Only set with `BuildOptions.is_alone`.
    """

    built: list[str] = field(default_factory=list)
    unchanged: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    skipped: dict[str, str] = field(default_factory=dict)
    projects: dict[str, Project] = field(default_factory=dict)
    needs_genuine: list[str] = field(default_factory=list)
