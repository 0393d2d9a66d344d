"""`roslib.stack_manifest`, for legacy scripts: the contents of a stack's `stack.xml`."""

from __future__ import annotations

from pathlib import Path

from pipros.basics.lazy_names import star_names as _star_names
from pipros.workspace.dry_manifest import DryManifest
from roslib import manifestlib
from roslib.manifestlib import ManifestException as ManifestException
from roslib.manifestlib import StackDepend as StackDepend
from roslib.stacks import get_stack_dir

_star_names(__name__, "os roslib")

STACK_FILE = "stack.xml"


class StackManifest(DryManifest):
    """Contents of a `stack.xml`."""

    def __init__(self) -> None:
        super().__init__("stack")


def stack_file(stack: str, required: bool = True) -> str:
    """Return the path of a stack's `stack.xml`. Unless it is `required`, the file need not exist.

    Raises:
        InvalidROSStackException: the stack does not exist.
        ManifestException: the file is `required` but missing.
    """
    file = Path(get_stack_dir(stack), STACK_FILE)
    if required and not file.is_file():
        raise ManifestException(f"Stack '{stack}' is improperly configured: no manifest file is present.")
    return str(file)


def parse_file(file: str) -> StackManifest:
    """Read a `stack.xml`.

    Raises:
        ValueError: the file does not exist.
        ManifestException: the file is not the manifest of a stack.
    """
    manifest = StackManifest()
    manifestlib.parse_file(manifest, file)
    return manifest


def parse(string: str, filename: str = "string") -> StackManifest:
    """Parse the text of a `stack.xml`. Raises ManifestException like `parse_file`."""
    manifest = StackManifest()
    manifestlib.parse(manifest, string, filename)
    return manifest
