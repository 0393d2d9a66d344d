"""Writes the files that run pipros in a browser: Pyodide from npm, the wheel of this tree, and libraries.

Run it with `.venv/bin/python script/pyodide_files.py FOLDER`. `script/docs` calls `on_post_build` for the
documentation, and `tests.pyodide` runs programs with the same files under Node.js.
"""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = "pyodide@314.0.7"
"""A fixed version, because the next one may contain a different version of Python."""

INSTALLED = ROOT / ".venv" / "pyodide"
"""A separate folder, because npm removes packages that its command line does not name."""

TAB_PAGE = ROOT / "packages" / "pipros-tab" / "src" / "pipros" / "tab" / "page"

PYODIDE_FILES = (
    "pyodide.mjs",
    "pyodide.asm.mjs",
    "pyodide.asm.wasm",
    "python_stdlib.zip",
    "pyodide-lock.json",
)
LIBRARIES = ("catkin_pkg", "mcap", "rospkg", "yaml", "pyparsing", "dateutil", "websockets")
"""What messages, bags, parameters, `catkin_make` and pages need. Compiled parts are optional."""


def write_files(folder: Path) -> None:
    """Write Pyodide's files, `pipros.whl` and `libraries.zip` to the folder.

    Raises:
        SystemExit: npm is missing or failed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    source = _installed_pyodide()
    for name in PYODIDE_FILES:
        shutil.copyfile(source / name, folder / name)
    _build_wheel(folder / "pipros.whl")
    with zipfile.ZipFile(folder / "libraries.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for library in LIBRARIES:
            found = importlib.util.find_spec(library)
            if found is None or found.origin is None:
                raise SystemExit(f"{library} is not installed. Run: script/venv docs")
            files = Path(found.origin).parent
            for file in sorted((*files.rglob("*.py"), *files.rglob("*.in"))):
                archive.write(file, Path(library, file.relative_to(files)))


def write_tab(folder: Path) -> None:
    """Write the page that runs ROS in a browser tab. Any web server can serve the folder.

    Raises:
        SystemExit: npm is missing or failed.
    """
    write_files(folder / "files")
    for file in (*TAB_PAGE.iterdir(), ROOT / "docs" / "in-browser" / "start.mjs"):
        shutil.copyfile(file, folder / file.name)


def on_post_build(config: Any) -> None:
    """Add the files to the documentation. MkDocs calls this hook after it has written the pages."""
    write_tab(Path(config["site_dir"], "in-browser"))


def _installed_pyodide() -> Path:
    modules = INSTALLED / "node_modules" / "pyodide"
    version = PACKAGE.partition("@")[2]
    about = modules / "package.json"
    if not about.is_file() or f'"version": "{version}"' not in about.read_text(encoding="utf-8"):
        npm = shutil.which("npm")
        if npm is None:
            raise SystemExit(f"npm is not installed. It is needed to get {PACKAGE}, Python for browsers.")
        options = ("--no-save", "--no-package-lock", "--silent", "--no-audit", "--no-fund")
        command = (npm, "install", *options, "--prefix", INSTALLED, PACKAGE)
        if subprocess.run(command, check=False).returncode:  # noqa: S603
            raise SystemExit(f"npm cannot install {PACKAGE}")
    return modules


def _build_wheel(path: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        command = (sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder)
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True)  # noqa: S603
        (wheel,) = Path(folder).glob("*.whl")
        shutil.move(wheel, path)


if __name__ == "__main__":
    (write_tab if sys.argv[2:] == ["--tab"] else write_files)(Path(sys.argv[1]))
