"""`roslib.manifestlib`: manifests from before catkin; a facade of `pipros.workspace.dry_manifest`."""

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
    """A manifest is not what it should be."""


def parse(m: DryManifest, string: str, filename: str = "string") -> DryManifest:
    """Fills a manifest from the text of a file, and returns it.

    Raises:
        ManifestException: it is not such a file.
    """
    try:
        return read_into(m, string, filename)
    except MalformedManifest as error:
        raise ManifestException(str(error)) from None


def parse_file(m: DryManifest, file: str) -> DryManifest:
    """As `parse`, of a file.

    Raises:
        ValueError: the file does not exist.
    """
    if not file or not Path(file).is_file():
        raise ValueError(f"Invalid/non-existent manifest file: {file}")
    return parse(m, Path(file).read_text("utf-8"), file)
