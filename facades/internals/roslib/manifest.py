"""`roslib.manifest`, for old scripts: what the `manifest.xml` of a package says."""

from __future__ import annotations

from pathlib import Path

from pipros.basics.lazy_names import star_names as _star_names
from pipros.workspace.dry_manifest import DryManifest
from roslib import manifestlib
from roslib.manifestlib import Depend as Depend
from roslib.manifestlib import Export as Export
from roslib.manifestlib import ManifestException as ManifestException
from roslib.manifestlib import ROSDep as ROSDep
from roslib.manifestlib import VersionControl as VersionControl
from roslib.packages import InvalidROSPkgException, get_pkg_dir

_star_names(__name__, "os roslib")

MANIFEST_FILE = "manifest.xml"


class Manifest(DryManifest):
    """What a `manifest.xml` says."""

    def __init__(self) -> None:
        super().__init__("package")


def load_manifest(package: str) -> Manifest:
    """The manifest of a package.

    Raises:
        InvalidROSPkgException: the package does not exist, or it has no `manifest.xml`.
    """
    return parse_file(str(manifest_file(package)))


def manifest_file(package: str, required: bool = True, env: object = None) -> str | None:
    """The path of a package's `manifest.xml`, also of one that is not there unless it is `required`.

    None when the package does not exist.

    Raises:
        InvalidROSPkgException: the package does not exist or file, and it is `required`.
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
    """Reads a `manifest.xml`.

    Raises:
        ValueError: the file does not exist.
        ManifestException: it is not the manifest of a package.
    """
    manifest = Manifest()
    manifestlib.parse_file(manifest, file)
    return manifest


def parse(string: str, filename: str = "string") -> Manifest:
    """Reads the text of a `manifest.xml`; raises as `parse_file`."""
    manifest = Manifest()
    manifestlib.parse(manifest, string, filename)
    return manifest
