"""`roslib.manifest`, for legacy scripts: the contents of a package's `manifest.xml`."""

from __future__ import annotations

from pathlib import Path

from pipros.basics.lazy_names import star_names as _star_names
from pipros.workspace.dry_manifest import Depend as Depend
from pipros.workspace.dry_manifest import DryManifest, MalformedManifest, read_into
from pipros.workspace.dry_manifest import Export as Export
from pipros.workspace.dry_manifest import ROSDep as ROSDep
from pipros.workspace.dry_manifest import VersionControl as VersionControl
from roslib.exceptions import ROSLibException
from roslib.packages import InvalidROSPkgException, get_pkg_dir

_star_names(__name__, "os roslib")

MANIFEST_FILE = "manifest.xml"


class ManifestException(ROSLibException):
    """A manifest is invalid."""


class Manifest(DryManifest):
    """Contents of a `manifest.xml`."""


def load_manifest(package: str) -> Manifest:
    """Return the manifest of a package.

    Raises:
        InvalidROSPkgException: the package does not exist, or it has no `manifest.xml`.
    """
    return parse_file(str(manifest_file(package)))


def manifest_file(package: str, required: bool = True, env: object = None) -> str | None:
    """Return the path of a package's `manifest.xml`, or None if the package does not exist.

    The file does not need to exist unless `required` is true.

    Raises:
        InvalidROSPkgException: `required` is true, and the package or the file does not exist.
    """
    del env
    folder = get_pkg_dir(package, required)
    if folder is None:
        return None
    file = Path(folder, MANIFEST_FILE)
    if required and not file.is_file():
        raise InvalidROSPkgException(
            f"\nPackage '{folder}' is improperly configured: no manifest file is present.\n"
        )
    return str(file)


def parse_file(file: str) -> Manifest:
    """Read a `manifest.xml`.

    Raises:
        ValueError: the file does not exist.
        ManifestException: the file is not the manifest of a package.
    """
    if not file or not Path(file).is_file():
        raise ValueError(f"Invalid/non-existent manifest file: {file}")
    return parse(Path(file).read_text("utf-8"), file)


def parse(string: str, filename: str = "string") -> Manifest:
    """Parse the text of a `manifest.xml`. Raises ManifestException like `parse_file`."""
    manifest = Manifest()
    try:
        read_into(manifest, string, filename)
    except MalformedManifest as error:
        raise ManifestException(str(error)) from None
    return manifest
