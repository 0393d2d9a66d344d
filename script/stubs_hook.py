"""Puts type stubs for the messages that ship with pipros into the wheel, as `<package>-stubs` (PEP 561).

Leaves out the rooms that `PIPROS_ROOMS` does not name; see `build_rooms.py`.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class StubsHook(BuildHookInterface[Any]):
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        source = Path(self.root) / "build" / "src"
        sys.path[:0] = [str(source), str(Path(self.root) / "script")]
        from build_rooms import rooms_of_build

        rooms = rooms_of_build(self.root)  # before the imports: it makes them those of the source tree
        from pipros.msg.language.definition_files import DefinitionFiles
        from pipros.msg.language.definitions import Definitions
        from pipros.msg.stubs import write_stubs

        share = source / "pipros" / "share"
        self._folder = tempfile.TemporaryDirectory()
        excluded = rooms.excluded()
        packages = sorted(
            folder.name for folder in share.iterdir() if f"pipros/share/{folder.name}" not in excluded
        )
        definitions = Definitions(DefinitionFiles(lambda name: share / name if name in packages else None))
        if version == "editable":
            # The settings for an editable installation replace those in pyproject.toml.
            included = build_data["force_include_editable"] = dict(self.build_config.get_force_include())
        else:
            included = build_data["force_include"]
        if excluded and version != "editable":
            self.build_config.target_config["exclude"] = [
                f"/packages/*/{root}/{path}" for path in excluded for root in ("src", "facades")
            ]
            absent = Path(self._folder.name, "left_out.json")
            absent.write_text(json.dumps(rooms.absent_commands()))
            included[str(absent)] = "pipros/left_out.json"
        modules = {file.parent.name for file in Path(self.root).glob("packages/*/facades/*/__init__.py")}
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
