"""Selects the files of the wheel: the sources and facades of all packages, or of the one that is built.

Adds type stubs for the messages that ship with pipros, as `<package>-stubs` (PEP 561). Leaves out the rooms
that `PIPROS_ROOMS` does not name; see `build_rooms.py`.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


def folders_of_wheel(folder: Path) -> list[str]:
    """Return the folders whose content is installed, relative to that of a build."""
    pattern = "packages/*/" if (folder / "packages").is_dir() else ""
    return sorted(
        str(found.relative_to(folder)) for name in ("src", "facades") for found in folder.glob(pattern + name)
    )


class StubsHook(BuildHookInterface[Any]):
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        sys.path.insert(0, str(Path(__file__).parent))
        from build_rooms import repository_of, rooms_of_build

        folder, root = Path(self.root), repository_of(Path(self.root))
        source = root / "build" / "src"
        parts = folders_of_wheel(folder)
        self.build_config.target_config.update({"sources": parts, "only-include": parts})
        rooms = rooms_of_build(self.root)  # before the imports: it makes them those of the source tree
        from pipros.msg.language.definition_files import DefinitionFiles
        from pipros.msg.language.definitions import Definitions
        from pipros.msg.stubs import write_stubs

        share = source / "pipros" / "share"
        self._folder = tempfile.TemporaryDirectory()
        excluded = rooms.excluded()
        packages = sorted(
            found.parent.name
            for part in parts
            for found in folder.glob(f"{part}/pipros/share/*/package.xml")
            if f"pipros/share/{found.parent.name}" not in excluded
        )
        definitions = Definitions(DefinitionFiles(lambda name: share / name if name in packages else None))
        if version == "editable":
            # The settings for an editable installation replace those in pyproject.toml.
            included = build_data["force_include_editable"] = {
                str(source / "pipros.pth"): "pipros.pth",
                **self.build_config.get_force_include(),
            }
        else:
            included = build_data["force_include"]
        if excluded and version != "editable":
            self.build_config.target_config["exclude"] = [
                f"/packages/*/{root}/{path}" for path in excluded for root in ("src", "facades")
            ]
            absent = Path(self._folder.name, "left_out.json")
            absent.write_text(json.dumps(rooms.absent_commands()))
            included[str(absent)] = "pipros/left_out.json"
        if folder != root:  # its own pyproject.toml can only name licences in its folder
            names = ["LICENSE", *(["THIRD_PARTY.md"] if any(folder.glob("src/pipros/*/page/vendor")) else [])]
            licences = f"{self.metadata.name.replace('-', '_')}-{self.metadata.version}.dist-info/licenses"
            included.update({str(root / name): f"{licences}/{name}" for name in names})
        modules = {file.parent.name for file in root.glob("packages/*/facades/*/__init__.py")}
        for file in write_stubs(
            packages,
            Path(self._folder.name),
            definitions,
            suffix="-stubs",
            has_module=modules.__contains__,
        ):
            included[str(file)] = str(file.relative_to(self._folder.name))
        # these modules are typed, so they serve as stubs themselves
        for module in share.glob("*/src/*/[a-z]*.py"):
            if module.relative_to(share).parts[0] not in packages:
                continue
            stub = Path(self._folder.name, f"{module.parent.name}-stubs", f"{module.stem}.pyi")
            shutil.copy(module, stub)  # files that are included from their own folder are excluded here
            included[str(stub)] = str(stub.relative_to(self._folder.name))

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:  # noqa: ARG002
        self._folder.cleanup()
