"""Writes the files that run pipros in a browser: packages from npm, the wheel of this tree, and libraries.

Run it with `.venv/bin/python script/pyodide_files.py FOLDER`. `script/docs` calls `on_post_build` for the
documentation, and `tests.pyodide` runs programs with the same files under Node.js.
"""

from __future__ import annotations

import importlib.util
import json
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

EDITOR = (
    "@codemirror/autocomplete@6.20.4",
    "@codemirror/commands@6.11.1",
    "@codemirror/lang-python@6.2.1",
    "@codemirror/lang-xml@6.1.0",
    "@codemirror/language@6.13.1",
    "@codemirror/state@6.7.6",
    "@codemirror/streamparser@6.0.0",
    "@codemirror/view@6.43.15",
    "@lezer/common@1.5.5",
    "@lezer/highlight@1.2.5",
    "@lezer/lr@1.4.12",
    "@lezer/python@1.1.19",
    "@lezer/xml@1.0.6",
    "@marijn/find-cluster-break@1.0.4",
    "crelt@1.0.7",
    "style-mod@4.1.5",
    "w3c-keyname@2.2.8",
)
"""CodeMirror, the editor of the tab, and what it imports. The page maps names of modules to the copies."""

INSTALLED = ROOT / ".venv" / "pyodide"
"""A separate folder, like `codemirror`, because npm removes packages that its command line does not name."""

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
    """Write Pyodide's files, `pipros.whl`, `libraries.zip` and the modules of CodeMirror to the folder.

    Raises:
        SystemExit: npm is missing or failed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    source = _installed(PACKAGE)[0]
    for name in PYODIDE_FILES:
        shutil.copyfile(source / name, folder / name)
    _write_editor(folder / "editor")
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


def _write_editor(folder: Path) -> None:
    """Write the modules of CodeMirror to the folder, unchanged, each beside the licence of its package."""
    for source in _installed(*EDITOR):
        about = json.loads((source / "package.json").read_text(encoding="utf-8"))
        main = about.get("module") or about["exports"]["import"]
        target = folder / about["name"]
        target.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source / main, target / "index.js")
        shutil.copyfile(source / "LICENSE", target / "LICENSE")


def _installed(*packages: str) -> list[Path]:
    """Return the folders of npm packages, which are installed unless they are there with these versions."""
    prefix = INSTALLED if PACKAGE in packages else INSTALLED.with_name("codemirror")
    folders = [prefix / "node_modules" / each.rpartition("@")[0] for each in packages]
    if not all(map(_is_installed, folders, packages)):
        npm = shutil.which("npm")
        if npm is None:
            raise SystemExit(f"npm is not installed. It is needed to get {', '.join(packages)}.")
        options = ("--no-save", "--no-package-lock", "--silent", "--no-audit", "--no-fund")
        command = (npm, "install", *options, "--prefix", str(prefix), *packages)
        if subprocess.run(command, check=False).returncode:  # noqa: S603
            raise SystemExit(f"npm cannot install {', '.join(packages)}")
    return folders


def _is_installed(folder: Path, package: str) -> bool:
    about = folder / "package.json"
    version = package.rpartition("@")[2]
    return about.is_file() and f'"version": "{version}"' in about.read_text(encoding="utf-8")


def _build_wheel(path: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        command = (sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder)
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True)  # noqa: S603
        (wheel,) = Path(folder).glob("*.whl")
        shutil.move(wheel, path)


if __name__ == "__main__":
    (write_tab if sys.argv[2:] == ["--tab"] else write_files)(Path(sys.argv[1]))
