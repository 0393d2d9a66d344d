"""Tests of the page's pure JavaScript modules in Node.js, with vectors written by their Python twins.

`python -m tests.support.page_units` runs them; `script/check page` does, too. It prints the coverage of the
modules, and fails if it is below `LEAST_PERCENT` for one of them.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.support.environments import file_of_tests, source
from tests.support.page_vectors import vectors

PAGE = source("pipros_page/page")
SHARED = source("pipros_server/page")
UNITS = file_of_tests("page/unit")
MODULES = {
    "scene/frames.js": 97, "scene/pose.js": 97, "scene/transform_texts.js": 97, "scene/layout.js": 97,
    "scene/camera_model.js": 97, "scene/views.js": 93, "panels/layout.js": 97, "plot/curve.js": 97,
    "plot/curve_text.js": 97, "bags/marks.js": 97, "bags/visible_time.js": 97, "place.js": 97,
    "notice_texts.js": 97, "plot/selection.js": 97, "stale.js": 60, "silence.js": 97,
    "partial_message.js": 97, "angles.js": 97, "image_address.js": 97,
}  # fmt: skip
"""The pure modules, with the least percentage of lines that the tests must run."""
_COVERED = re.compile(r"^\S\s+(\S+\.js)\s*\|\s*([\d.]+)\s*\|", re.MULTILINE)


def prepare(folder: Path) -> None:
    """Copy the page and its tests to a folder in which Node.js finds modules and three.js."""
    shutil.copytree(PAGE, folder / "page")
    shutil.copytree(SHARED, folder / "page", dirs_exist_ok=True)
    shutil.copytree(UNITS, folder / "unit")
    (folder / "package.json").write_text('{"type": "module"}')
    library = folder / "node_modules" / "three"
    shutil.copytree(PAGE / "vendor" / "three", library)
    exports = {".": "./three.module.js", "./addons/*": "./addons/*"}
    (library / "package.json").write_text(json.dumps({"type": "module", "exports": exports}))
    (folder / "vectors.json").write_text(json.dumps(vectors()))


def run(folder: Path) -> tuple[int, str]:
    """Return the exit code and the output of Node.js."""
    files = sorted(str(file.relative_to(folder)) for file in (folder / "unit").glob("*.test.js"))
    words = ["node", "--test", "--experimental-test-coverage", "--test-reporter=spec", *files]
    ended = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    return ended.returncode, ended.stdout + ended.stderr


def coverage(output: str) -> dict[str, float]:
    """Return the percentage of covered lines of each of `MODULES` in the output of Node.js.

    Later versions write names in a tree instead of paths: files of one name then share the smaller figure.
    """
    found = [(name, float(percent)) for name, percent in _COVERED.findall(output)]
    return {
        module: min(
            (percent for name, percent in found if f"page/{module}" == name or Path(module).name == name),
            default=0.0,
        )
        for module in MODULES
    }


def uncovered(covered: dict[str, float]) -> list[str]:
    """Return a line for each module that is covered too little."""
    return [
        f"{name}: tests run {covered[name]:.1f} % of its lines, at least {least} % are required"
        for name, least in MODULES.items()
        if covered[name] < least
    ]


def main() -> int:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(folder)
        code, output = run(folder)
    covered = coverage(output)
    problems = uncovered(covered)
    if code or problems:
        print(output)
    print(*problems, sep="\n", end="\n" if problems else "")
    average = sum(covered.values()) / len(covered)
    print(f"JavaScript: tests run {average:.0f} % of the lines of {len(MODULES)} pure modules")
    return 1 if code or problems else 0


if __name__ == "__main__":
    sys.exit(main())
