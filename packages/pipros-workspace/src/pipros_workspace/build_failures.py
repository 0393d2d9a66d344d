"""The packages of a build that fail, and those that are skipped because they depend on them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pipros_workspace.build_result import BuildResult
from pipros_workspace.layout import SourcePackage

if TYPE_CHECKING:
    from pipros.basics.printable import Say


class BuildFailures:
    """The failures of a build.

    Attributes:
        failed: packages that failed or are skipped, each with the package that is the cause.
        broken: the same for packages of which only the compiled part failed.
    """

    def __init__(self, result: BuildResult, say: Say) -> None:
        """Store the arguments. Failures are added to the result."""
        self.failed: dict[str, str] = {}
        self.broken: dict[str, str] = {}
        self._result = result
        self._say = say

    def add(self, package: SourcePackage, reason: str) -> None:
        """Report that a package cannot be built."""
        self._say(reason)
        self.failed[package.name] = package.name
        self._result.errors.append(f"{package.name}: {reason}")

    def add_native(self, package: SourcePackage, reason: str, *, is_said: bool = True) -> None:
        """Report that the compiled part of a package cannot be built. Its other parts are not affected."""
        if is_said:
            self._say(reason)
        self.broken[package.name] = package.name
        self._result.errors.append(f"{package.name}: {reason}")

    def is_broken(self, package: SourcePackage) -> bool:
        """Return whether the compiled part of the package, or of one of its dependencies, failed.

        If a dependency failed, report the package as skipped.
        """
        if package.name in self.broken:
            return True
        needed = (name for name in sorted(package.all_dependencies) if name in self.broken)
        culprit = self.broken.get(next(needed, ""))
        if culprit is None:
            return False
        self.broken[package.name] = self._result.skipped[package.name] = culprit
        self._say(f"-- {package.name} is not compiled, because it needs {culprit}, which failed")
        return True

    def is_blocked(self, package: SourcePackage) -> bool:
        """Return whether a dependency of the package failed. If so, report the package as skipped."""
        for name in sorted(package.all_dependencies):
            culprit = self.failed.get(name)
            if culprit is not None:
                self.failed[package.name] = culprit
                self._result.skipped[package.name] = culprit
                self._say(f"-- {package.name} is skipped, because it needs {culprit}, which failed")
                return True
        return False
