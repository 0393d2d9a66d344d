"""`roslib.manifest`, for old scripts: reads manifests of packages with rospkg."""

from __future__ import annotations

from pathlib import Path

from rospkg import MANIFEST_FILE as MANIFEST_FILE
from rospkg import Manifest as Manifest
from rospkg import RosPack
from rospkg.manifest import parse_manifest

from roslib.packages import InvalidROSPkgException, get_pkg_dir


def load_manifest(package: str) -> Manifest:
    """The manifest of a package: its `package.xml` or `manifest.xml`.

    Raises:
        rospkg.ResourceNotFound: the package does not exist.
    """
    return RosPack().get_manifest(package)


def manifest_file(package: str, required: bool = True, env: object = None) -> str | None:
    """The path of a package's `manifest.xml`; None if it does not exist and is not `required`.

    Raises:
        InvalidROSPkgException: it is `required`, and the package or the file does not exist.
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
        rospkg.InvalidManifest: the text is not a valid manifest.
    """
    return parse_manifest(MANIFEST_FILE, string, filename)
