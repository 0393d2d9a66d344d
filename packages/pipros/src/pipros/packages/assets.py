"""Read the files in ROS packages that clients may display: meshes, textures and robot models."""

from __future__ import annotations

import errno
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Final, TypeVar
from urllib.parse import unquote

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable

PREFIX: Final = "package://"
NAMES: Final = re.compile(
    r"(?:[\w. -]+/){0,999}[\w. -]+\."
    r"(?:dae|fbx|glb|gltf|jpe?g|mtl|obj|png|ply|sdf|srdf|stl|svg|tga|tiff?|urdf|webp|xacro)",
    re.IGNORECASE | re.ASCII,
)
"""Paths that clients may fetch: files that describe a robot or its world."""


T = TypeVar("T")


class AssetRefused(PiprosError):
    """An asset does not exist, or clients may not fetch it."""


def read_asset(
    uri: str,
    folders_of: Callable[[str], Iterable[Path]],
    limit_bytes: int,
    read: Callable[[Path, int], T],
) -> T:
    """Return the content of a file in a package, as `read` returns it. Blocks.

    No part of the path may be hidden, and the file must be inside one of the package's folders even after all
    links are resolved.

    Args:
        uri: `package://NAME/PATH`, percent-encoded or not.
        folders_of: function that returns the folders of a package.
        read: function that reads a file of at most `limit_bytes`, for example `read_file`.

    Raises:
        AssetRefused: the file cannot be read, or clients may not read it. The error text reveals nothing
            about other files.
    """
    shown = printable(uri, 300)
    if not uri.startswith(PREFIX):
        raise AssetRefused(f"[{shown}] must begin with {PREFIX}")
    package, _, path = unquote(uri.removeprefix(PREFIX)).partition("/")
    parts = path.split("/")
    if not NAMES.fullmatch(path) or any(part.startswith(".") for part in parts) or package.startswith("."):
        raise AssetRefused(f"[{shown}] is not a file that may be fetched")
    for folder in folders_of(package):
        try:
            root = folder.resolve(strict=True)
            file = root.joinpath(*parts).resolve(strict=True)
            if not file.is_relative_to(root) or not NAMES.fullmatch(file.name):
                continue
            return read(file, limit_bytes)
        except OSError as error:
            if error.errno == errno.EFBIG:
                raise AssetRefused(f"[{shown}]: {error.strerror}") from None
        except (RuntimeError, ValueError):  # the links form a cycle, or the path contains a null character
            continue
    raise AssetRefused(f"[{shown}] was not found")
