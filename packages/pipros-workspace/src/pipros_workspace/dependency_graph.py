"""Dependencies between packages, as `rospack` prints them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from pipros.basics.errors import NotFound, PiprosError
from pipros.safe.xml import XmlError
from pipros_workspace.index import Package, PackageIndex
from pipros_workspace.manifest import Manifest, read_manifest

_DEPTH_LIMIT = 1000


class CircularDependency(PiprosError):
    """Packages depend on each other in a cycle."""


class DependencyGraph:
    """Dependencies between the packages in an index.

    Dependencies that are not in the index are ignored, except by `named` and `rosdeps`.
    """

    def __init__(self, index: PackageIndex) -> None:
        self._index = index
        self._listed: dict[str, Package] | None = None
        self.manifest = lru_cache(maxsize=None)(self._read)

    def _read(self, name: str) -> Manifest:
        package = self._get(name)
        return read_manifest((package or self._index.find(name)).path)

    def _get(self, name: str) -> Package | None:
        """Return a package, or None. The disk is not examined again once all packages were listed."""
        return self._index.get(name) if self._listed is None else self._listed.get(name)

    def direct(self, name: str) -> list[str]:
        """Return the packages that a package depends on at run time.

        Raises:
            NotFound: the package is not in the index.
            XmlError: the package's manifest is malformed.
        """
        return [needed for needed in self.manifest(name).depends("exec_depends") if self._get(needed)]

    def named(self, name: str) -> list[str]:
        """Return the sorted dependencies of all kinds in a manifest, whether or not they are in the index."""
        return sorted(self.manifest(name).depends())

    def rosdeps(self, name: str, *, only_direct: bool = False) -> list[str]:
        """Return the sorted rosdep keys that a package and (unless `only_direct`) its dependencies need.

        For a dry package, these are the system packages in `manifest.xml` files; for other packages, all
        dependencies in the manifests.
        """
        names = [name, *([] if only_direct else self.all(name))]
        if self.manifest(name).is_dry:
            return sorted({key for needed in names for key in self.manifest(needed).rosdeps})
        return sorted({key for needed in names for key in self.named(needed)})

    def all(self, name: str) -> list[str]:
        """Return all direct and indirect dependencies of a package, dependencies first.

        Raises:
            CircularDependency: packages depend on each other in a cycle.
            NotFound, XmlError: see `direct`.
        """
        ordered: dict[str, None] = {}
        self._collect(name, ordered, ())
        del ordered[name]
        return list(ordered)

    def _collect(self, name: str, ordered: dict[str, None], path: tuple[str, ...]) -> None:
        if name in path:
            cycle = " -> ".join([*path[path.index(name) :], name])
            raise CircularDependency(f"package '{name}' depends on itself: {cycle}")
        for needed in self.direct(name):
            if needed not in ordered:
                self._collect(needed, ordered, (*path, name))
        ordered[name] = None

    def chains(self, name: str, target: str) -> Iterator[list[str]]:
        """Yield each dependency path from one package to another, as a list of names without repetitions."""
        yield from self._chains(name, target, [name])

    def _chains(self, name: str, target: str, path: list[str]) -> Iterator[list[str]]:
        for needed in self.direct(name):
            if needed == target:
                yield [*path, needed]
            elif needed not in path and len(path) < _DEPTH_LIMIT:
                yield from self._chains(needed, target, [*path, needed])

    def dependents(self, name: str, *, only_direct: bool = False) -> list[str]:
        """Return the packages that depend on a package, directly or (unless `only_direct`) indirectly.

        Packages with an unreadable manifest are skipped.
        """
        users: dict[str, list[str]] = {}
        self._listed = {package.name: package for package in self._index}
        for package in self._listed:
            try:
                for needed in self.direct(package):
                    users.setdefault(needed, []).append(package)
            except (XmlError, NotFound, OSError):
                continue
        found: dict[str, None] = {}
        pending = [name]
        while pending:
            for user in users.get(pending.pop(0), []):
                if user not in found:
                    found[user] = None
                    if not only_direct:
                        pending.append(user)
        return list(found)

    def exporters(self, name: str, attribute: str, top: str | None = None) -> Iterator[tuple[Package, str]]:
        """Yield each package that exports `<name attribute="…">`, with the value of the attribute.

        Only the package `name` and its direct dependents are searched. If `top` is given, dependents other
        than `top` and its dependencies are skipped. `${prefix}` in a value is replaced by the package's
        folder.
        """
        candidates = self.dependents(name, only_direct=True)
        if top is not None:
            wanted = {top, *self.all(top)}
            candidates = [candidate for candidate in candidates if candidate in wanted]
        for candidate in [*candidates, name]:
            package = self._index.find(candidate)
            for export in self.manifest(candidate).exports:
                value = export.attributes.get(attribute)
                if export.tag == name and value is not None:
                    yield package, value.replace("${prefix}", str(package.path))
