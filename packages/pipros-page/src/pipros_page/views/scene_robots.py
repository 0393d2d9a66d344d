"""Robot descriptions for the Scene tab, and the meshes and textures that they name."""

from __future__ import annotations

import contextlib
import dataclasses
import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, Final
from urllib.parse import unquote

from pipros.basics.errors import Refused
from pipros.basics.input_file import read_file
from pipros.basics.limits import process_limits
from pipros.basics.windows import path_of_url
from pipros.packages.assets import NAMES, PREFIX, read_asset
from pipros_libraries.robot_model.urdf import UrdfError
from pipros_libraries.robot_model.visuals import named_files, read_shapes
from pipros_page.limits import PageLimits
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused
from pipros_tools.graph import params
from pipros_workspace.index import PackageIndex

LONGEST_DESCRIPTION: Final = 16_000_000
DESCRIPTIONS: Final = 20
"""Maximum number of robot descriptions, one per parameter, whose `file://` resources browsers may read."""
FILE: Final = "file://"


class RobotDescriptions:
    """The robot descriptions that browsers show."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system
        self._packages = PackageIndex.from_environment(system.node.environment)
        self._files: dict[str, frozenset[str]] = {}  # by parameter name, oldest first

    def text(self, name: str) -> str:
        """Look up a parameter as rviz does: by its resolved name, then in the enclosing namespaces."""
        master = self._system.graph.master
        with contextlib.suppress(params.ParameterNotSet):
            return str(params.read(master, self._system.node.resolve(name)))
        with contextlib.suppress(params.ParameterNotSet, Refused):
            return str(params.read(master, master.search_param(name)))
        raise UrdfError(f"Parameter [{name}] does not exist, and was not found by searchParam()")

    def shapes(self, name: str, text: str) -> Mapping[str, Any]:
        """Return the links and shapes of a description, or an error."""
        if not text.strip():
            return {"error": "URDF is empty"}
        if len(text) > LONGEST_DESCRIPTION:
            return {"error": f"URDF is longer than {LONGEST_DESCRIPTION} characters"}
        try:
            links = read_shapes(text)
        except UrdfError as error:
            return {"error": f"Failed to parse URDF model: {error}"}
        self._files.pop(name, None)
        self._files[name] = frozenset(named_files(links))
        while len(self._files) > DESCRIPTIONS:
            del self._files[next(iter(self._files))]
        return {"links": [dataclasses.asdict(link) for link in links]}

    def read(self, uri: str) -> bytes:
        """Return the content of a mesh or texture. Raise `PiprosError` if browsers may not read it."""
        limit = process_limits().of(PageLimits).scene_resource_bytes
        if uri.startswith(FILE):
            return read_named_file(uri, frozenset().union(*self._files.values()), limit)
        if uri.startswith(PREFIX):
            # Paths in mesh files often contain . and ..: resolve them before the strict check.
            package, _, path_text = uri.removeprefix(PREFIX).partition("/")
            uri = f"{PREFIX}{package}/{os.path.normpath(path_text)}"
        return read_asset(uri, self._folders_of, limit, read_file)

    def _folders_of(self, package: str) -> tuple[Path, ...]:
        found = self._packages.get(package)
        return () if found is None else (found.path,)


def read_named_file(uri: str, named: Collection[str], limit_bytes: int) -> bytes:
    """Read a mesh or texture that a robot description names by a `file://` URI.

    Files in the same folders, such as a mesh's materials, can also be read.

    Raises:
        RequestRefused: no robot description names a file in this folder, or the file has another type or is
            unreadable.
    """
    path = Path(path_of_url(unquote(uri)))
    folders = {str(Path(path_of_url(unquote(each))).parent) for each in named if each.startswith(FILE)}
    try:
        real = path.resolve(strict=True)
        if str(path.parent) not in folders or not all(NAMES.fullmatch(each.name) for each in (path, real)):
            raise RequestRefused(f"{uri:.300} is not a mesh or texture named by the robot description")
        return read_file(real, limit_bytes)
    except (OSError, ValueError, RuntimeError) as error:
        raise RequestRefused(f"cannot read {uri:.300}: {getattr(error, 'strerror', error)}") from None
