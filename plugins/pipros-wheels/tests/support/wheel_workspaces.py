"""Write workspaces of many shapes, and build their wheels.

`python -m tests.support.wheel_workspaces` prints a table of them.
"""

from __future__ import annotations

import re
import sys
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path

from pipros_wheels.wheel_build import WheelOptions, build_wheels, source_packages
from tests.support.wheel_workspace_table import WORKSPACES, Pack
from tests.support.workspaces import MANIFEST

_CONTENTS = {
    ".msg": "int8 a\n",
    ".srv": "---\nbool ok\n",
    ".action": "---\n---\nint8 a\n",
    ".launch": "<launch/>\n",
}


def write_workspace(packs: dict[str, Pack], folder: Path) -> None:
    """Write the packages of a workspace below `folder/src`."""
    for path, pack in packs.items():
        root, name = folder / "src" / path, path.rpartition("/")[2]
        needed = "".join(f"  <depend>{item}</depend>\n" for item in pack.depends.split())
        texts = {"package.xml": MANIFEST.format(name=name, more=needed + pack.more)}
        if pack.cmake is not None:
            texts["CMakeLists.txt"] = f"cmake_minimum_required(VERSION 3.0.2)\nproject({name})\n{pack.cmake}"
        texts |= {file: _CONTENTS.get(Path(file).suffix, "") for file in pack.files.split()} | pack.texts
        for file, text in texts.items():
            (root / file).parent.mkdir(parents=True, exist_ok=True)
            (root / file).write_text(text)
        for file, target in pack.links.items():
            (root / file).symlink_to(target)


@dataclass(frozen=True, slots=True)
class Outcome:
    """The files of each wheel by package, and what was said, with the package's name first."""

    files: dict[str, set[str]]
    said: list[str]


def build_workspace(folder: Path) -> Outcome:
    """Build the wheels of a workspace."""
    space = source_packages([folder])
    build = build_wheels(space.packages, folder / "dist", WheelOptions(), lambda _line: None)
    files = {}
    for wheel in build.wheels:
        with zipfile.ZipFile(wheel.file) as archive:
            paths = [re.sub(r".*\.data/(?:data/)?", "", name) for name in archive.namelist()]
        files[wheel.package.name] = {
            re.sub(r"^scripts/", "bin/", path)
            for path in paths
            if ".dist-info/" not in path
            and not path.startswith("share/pipros/")
            and not path.endswith("/package.xml")
        }
    notes = [f"{wheel.package.name}: {note}" for wheel in build.wheels for note in wheel.notes]
    return Outcome(files, [*space.errors, *build.errors, *build.left_out, *notes])


def expected_files(path: str, pack: Pack) -> set[str] | None:
    """Return the files that a package's wheel must contain, or None if no wheel is built."""
    name = path.rpartition("/")[2]
    return (
        None
        if pack.expected is None
        else set(pack.expected.format(name).replace("@", f"share/{name}").split())
    )


def main() -> int:
    """Print the table."""
    print("| workspace | packages | wheels | files | said |\n| --- | ---: | ---: | ---: | --- |")
    for name, packs in WORKSPACES.items():
        with tempfile.TemporaryDirectory() as folder:
            write_workspace(packs, Path(folder))
            found = build_workspace(Path(folder))
            said = "; ".join(line.replace(folder, "").replace("\n", " ")[:110] for line in found.said)
        print(
            f"| {name} | {len(packs)} | {len(found.files)} | {sum(map(len, found.files.values()))} | {said} |"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
