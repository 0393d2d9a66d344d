"""Checks of the page's JavaScript: eslint, the TypeScript compiler, its bundle, and tests of pure modules."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tests.support import page_bundle, page_units
from tests.support.environments import REPOSITORY
from tests.support.npm import INSTALL, MODULES

SETTINGS = Path("packages", "pipros-page", "tests", "page")
_SERVER = Path("packages", "pipros-server", "src", "pipros_server")
_SIMULATION = Path("packages", "pipros-simulation", "src", "pipros_simulation")
PAGES = (
    Path("packages", "pipros-page", "src", "pipros_page", "page"),
    _SERVER / "page",
    _SERVER / "sliders" / "page",
    Path("plugins", "pipros-robot", "src", "pipros_robot", "perception", "windows", "page"),
    _SIMULATION / "robots" / "page",
    _SIMULATION / "turtlesim" / "page",
    Path("plugins", "pipros-tab", "src", "pipros_tab", "page"),
    Path("docs", "in-browser"),
)
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


def main() -> int:
    if missing():
        print(f"script/check page needs eslint, TypeScript and esbuild: {INSTALL}", file=sys.stderr)
        return 1
    lines = [*findings(), *page_bundle.differences()]
    print("\n".join(lines))
    return max(1 if lines else 0, page_units.main())


if __name__ == "__main__":
    sys.exit(main())
