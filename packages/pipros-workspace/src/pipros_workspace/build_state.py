"""What earlier builds of a workspace have built: a digest of the inputs of each package."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

import pipros
from pipros.basics.input_file import read_text
from pipros_workspace.catkin.project import Project
from pipros_workspace.devel import python_sources
from pipros_workspace.layout import SourcePackage, WorkspaceFolders
from pipros_workspace.setup_files import write_if_changed


class BuildState:
    """The digests of a workspace. Nothing is written before `write`."""

    def __init__(self, layout: WorkspaceFolders) -> None:
        self._layout = layout
        self._file = layout.build / "pipros" / "state.json"
        self._digests = _read(self._file)

    def is_current(self, name: str, digest: str) -> bool:
        """Return whether the package was last built from inputs with this digest."""
        return self._digests.get(name) == digest

    def set(self, name: str, digest: str) -> None:
        """Note that the package was built."""
        self._digests[name] = digest

    def forget(self, name: str) -> None:
        """Have the next build build the package again."""
        self._digests.pop(name, None)

    def write(self) -> None:
        """Write the digests for later builds.

        Raises:
            OSError: the build space cannot be written.
        """
        write_if_changed(self._file, json.dumps(self._digests, indent=1, sort_keys=True))

    def digest(self, package: SourcePackage, project: Project) -> str:
        """Return a digest of all inputs of the package's devel files."""
        inputs = [
            str(package.manifest_file),
            project.file,
            *(interface.path for interface in project.interfaces),
            *(os.path.join(project.folder, file) for file in project.config_files),
        ]
        inputs += [item.source for item in project.installations if item.is_python]
        inputs += [hook.source for hook in project.hooks]
        inputs += python_sources(project)
        texts = [hook.text for hook in project.hooks]
        digest = hashlib.sha256(f"{pipros.__file__} {self._layout} {texts}".encode())
        for path in inputs:
            try:
                status = os.stat(path)
                digest.update(f"{path}\0{status.st_mtime_ns}\0{status.st_size}\0{status.st_mode}\n".encode())
            except OSError:
                digest.update(f"{path}\0gone\n".encode())
        return digest.hexdigest()


def _read(file: Path) -> dict[str, str]:
    try:
        state = json.loads(read_text(file))
    except (OSError, ValueError, RecursionError):
        return {}
    return {str(name): str(digest) for name, digest in state.items()} if isinstance(state, dict) else {}
