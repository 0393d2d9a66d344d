"""Checks of the page's JavaScript: eslint, the TypeScript compiler, its bundle, and tests of pure modules.

The tests run in Node.js, with vectors written by their Python twins. They fail if the coverage of a module is
below that in `PURE`. `script/check page` runs all of them.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.support import page_bundle
from tests.support.environments import REPOSITORY, file_of_tests, source
from tests.support.npm import INSTALL, MODULES
from tests.support.page_vectors import vectors

SETTINGS = Path("packages", "pipros-page", "tests", "page")
_SERVER = Path("packages", "pipros-server", "src", "pipros_server")
_SIMULATION = Path("packages", "pipros-simulation", "src", "pipros_simulation")
PAGES = (
    Path("packages", "pipros-page", "src", "pipros_page", "page"), _SERVER / "page",
    _SERVER / "sliders" / "page",
    Path("plugins", "pipros-robot", "src", "pipros_robot", "perception", "windows", "page"),
    _SIMULATION / "robots" / "page", _SIMULATION / "turtlesim" / "page",
    Path("plugins", "pipros-tab", "src", "pipros_tab", "page"), Path("docs", "in-browser"),
)  # fmt: skip
VENDORED = f"{PAGES[0] / 'vendor'}{os.sep}"


def missing() -> list[Path]:
    """Return the paths of the programs that are not installed."""
    programs = [MODULES / ".bin" / name for name in ("eslint", "tsc", "esbuild")]
    return [program for program in programs if not program.exists()]


def findings() -> list[str]:
    """Return the lines that the two programs print, except those about vendored files."""
    config = str(SETTINGS / "eslint.config.cjs")
    lint = ["eslint", "--format", "stylish", "--config", config, *map(str, PAGES), str(SETTINGS / "unit")]
    types = ["tsc", "--pretty", "false", "--project", str(SETTINGS)]
    found = []
    for program, *words in (lint, types):
        done = subprocess.run(
            [MODULES / ".bin" / program, *words], cwd=REPOSITORY,
            env={**os.environ, "NODE_PATH": str(MODULES)}, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.stderr.strip() and done.returncode:
            found += done.stderr.splitlines()
        found += [
            line
            for line in done.stdout.splitlines()
            if (line.strip() and not line.startswith((VENDORED, "  ")))
            or (program == "eslint" and line.startswith("  "))
        ]
    return found


PAGE = source("pipros_page/page")
SHARED = source("pipros_server/page")
UNITS = file_of_tests("page/unit")
PURE = {
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


def run_node(folder: Path) -> tuple[int, str]:
    """Return the exit code and the output of Node.js."""
    files = sorted(str(file.relative_to(folder)) for file in (folder / "unit").glob("*.test.js"))
    words = ["node", "--test", "--experimental-test-coverage", "--test-reporter=spec", *files]
    ended = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    return ended.returncode, ended.stdout + ended.stderr


def coverage(output: str) -> dict[str, float]:
    """Return the percentage of covered lines of each of `PURE` in the output of Node.js.

    Later versions write names in a tree instead of paths: files of one name then share the smaller figure.
    """
    found = [(name, float(percent)) for name, percent in _COVERED.findall(output)]
    return {
        module: min(
            (percent for name, percent in found if f"page/{module}" == name or Path(module).name == name),
            default=0.0,
        )
        for module in PURE
    }


def uncovered(covered: dict[str, float]) -> list[str]:
    """Return a line for each module that is covered too little."""
    return [
        f"{name}: tests run {covered[name]:.1f} % of its lines, at least {least} % are required"
        for name, least in PURE.items()
        if covered[name] < least
    ]


def run_units() -> int:
    """Run the tests of the pure modules, and print what they found. Return 1 if something is wrong."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(folder)
        code, output = run_node(folder)
    covered = coverage(output)
    problems = uncovered(covered)
    if code or problems:
        print(output)
    print(*problems, sep="\n", end="\n" if problems else "")
    average = sum(covered.values()) / len(covered)
    print(f"JavaScript: tests run {average:.0f} % of the lines of {len(PURE)} pure modules")
    return 1 if code or problems else 0


def main() -> int:
    if missing():
        print(f"script/check page needs eslint, TypeScript and esbuild: {INSTALL}", file=sys.stderr)
        return 1
    lines = [*findings(), *page_bundle.differences()]
    print("\n".join(lines))
    return max(1 if lines else 0, run_units())


if __name__ == "__main__":
    sys.exit(main())
