"""`roslib.manifest`, for old scripts: what the manifest of a package says, by rospkg."""

from __future__ import annotations

from pathlib import Path

from rospkg import MANIFEST_FILE as MANIFEST_FILE
from rospkg import Manifest as Manifest
from rospkg import RosPack
from rospkg.manifest import parse_manifest

from roslib.packages import InvalidROSPkgException, get_pkg_dir


def load_manifest(package: str) -> Manifest:
    """The manifest of a package, whichever of the two kinds it has.

    Raises:
        rospkg.ResourceNotFound: there is no such package.
    """
    return RosPack().get_manifest(package)


def manifest_file(package: str, required: bool = True, env: object = None) -> str | None:
    """The path of a package's `manifest.xml`; None when it has none and it is not `required`.

    Raises:
        InvalidROSPkgException: there is no such package or file, and it is `required`.
    """
    del env
    folder = get_pkg_dir(package, required)
    if folder is not None and (file := Path(folder, MANIFEST_FILE)).is_file():
        return str(file)
    if required:
        raise InvalidROSPkgException(f"Package '{package}' has no {MANIFEST_FILE}")
    return None


def parse_file(file: str) -> Manifest:
    """Reads a `manifest.xml`."""
    return parse(Path(file).read_text("utf-8"), file)


def parse(string: str, filename: str = "string") -> Manifest:
    """Reads the text of a `manifest.xml`.

    Raises:
        rospkg.InvalidManifest: it is not the manifest of a package.
    """
    return parse_manifest(MANIFEST_FILE, string, filename)
