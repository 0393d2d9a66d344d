"""Workspaces for tests of `pipros_workspace.build`."""

import os
from pathlib import Path

import pytest

from pipros_workspace.build import build
from pipros_workspace.build_options import BuildOptions
from pipros_workspace.build_result import BuildResult
from pipros_workspace.layout import WorkspaceFolders

MANIFEST = """\
<package format="2">
  <name>{name}</name><version>0.1.0</version><description>d</description>
  <maintainer email="a@example.org">A</maintainer><license>Apache-2.0</license>
  <buildtool_depend>catkin</buildtool_depend>
{more}</package>
"""


def hide_setuptools(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let each `setup.py` use the substitutes of pipros, which saves two thirds of its processor time."""
    (folder / "hidden").mkdir()
    (folder / "hidden" / "setuptools.py").write_text("raise ImportError\n")
    monkeypatch.setenv("PYTHONPATH", str(folder / "hidden"), prepend=os.pathsep)


class Workspace:
    """A workspace below `base`, with the output of its last build."""

    def __init__(self, base: Path) -> None:
        (base / "src").mkdir(parents=True, exist_ok=True)
        self.base = base
        self.layout = WorkspaceFolders(base, base / "src", base / "build", base / "devel", base / "install")
        self.lines: list[str] = []

    def add(self, name: str, cmake: str = "catkin_package()", depends: str = "", **files: str) -> Path:
        folder = self.base / "src" / name
        folder.mkdir(parents=True)
        needed = "".join(f"  <depend>{item}</depend>\n" for item in depends.split())
        (folder / "package.xml").write_text(MANIFEST.format(name=name, more=needed))
        head = f"cmake_minimum_required(VERSION 3.0.2)\nproject({name})\n"
        (folder / "CMakeLists.txt").write_text(head + cmake + "\n")
        for path, content in files.items():
            file = folder / path.replace("__", "/").replace("_dot_", ".")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(content)
        return folder

    def build(self, variables: dict[str, str] | None = None, **options: object) -> BuildResult:
        self.lines.clear()
        chosen = BuildOptions(**options)  # type: ignore[arg-type]
        return build(self.layout, chosen, self.lines.append, {"PATH": "/nowhere", **(variables or {})})

    @property
    def output(self) -> str:
        return "\n".join(self.lines)
