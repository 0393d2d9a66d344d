"""`roslib.manifestlib`: manifests that predate catkin; a facade of `pipros.workspace.dry_manifest`."""

from __future__ import annotations

from pathlib import Path

from pipros.basics.lazy_names import star_names as _star_names
from pipros.workspace.dry_manifest import ALLOWXHTML as ALLOWXHTML
from pipros.workspace.dry_manifest import OPTIONAL as OPTIONAL
from pipros.workspace.dry_manifest import REQUIRED as REQUIRED
from pipros.workspace.dry_manifest import VALID as VALID
from pipros.workspace.dry_manifest import Depend as Depend
from pipros.workspace.dry_manifest import DryManifest, MalformedManifest, read_into
from pipros.workspace.dry_manifest import Export as Export
from pipros.workspace.dry_manifest import Platform as Platform
from pipros.workspace.dry_manifest import ROSDep as ROSDep
from pipros.workspace.dry_manifest import StackDepend as StackDepend
from pipros.workspace.dry_manifest import VersionControl as VersionControl
from roslib.exceptions import ROSLibException

_star_names(__name__, "dom=xml.dom.minidom os roslib")


class ManifestException(ROSLibException):
    """A manifest is invalid."""


def parse(m: DryManifest, string: str, filename: str = "string") -> DryManifest:
    """Fill a manifest from the text of a file, and return it.

    Raises:
        ManifestException: the text is not a manifest.
    """
    try:
        return read_into(m, string, filename)
    except MalformedManifest as error:
        raise ManifestException(str(error)) from None


def parse_file(m: DryManifest, file: str) -> DryManifest:
    """Fill a manifest from a file, and return it. Raises the same errors as `parse`, and:

    Raises:
        ValueError: the file does not exist.
    """
    if not file or not Path(file).is_file():
        raise ValueError(f"Invalid/non-existent manifest file: {file}")
    return parse(m, Path(file).read_text("utf-8"), file)
