"""Writes the files that run pipros in a browser: packages from npm, the wheel of this tree, and libraries.

`script/generate tab FOLDER` adds the page of the tab. `script/docs` calls `on_post_build` for the
documentation, and `tests.pyodide` runs programs with the same files under Node.js.
"""

import gzip
import importlib.util
import json
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[4]
PACKAGE = "pyodide@314.0.7"
"""A fixed version, because the next one may contain a different version of Python."""

EDITOR = (
    "@codemirror/autocomplete@6.20.4", "@codemirror/commands@6.11.1", "@codemirror/lang-python@6.2.1",
    "@codemirror/lang-xml@6.1.0", "@codemirror/language@6.13.1", "@codemirror/state@6.7.6",
    "@codemirror/streamparser@6.0.0", "@codemirror/view@6.43.15", "@lezer/common@1.5.5",
    "@lezer/highlight@1.2.5", "@lezer/lr@1.4.12", "@lezer/python@1.1.19", "@lezer/xml@1.0.6",
    "@marijn/find-cluster-break@1.0.4", "crelt@1.0.7", "style-mod@4.1.5", "w3c-keyname@2.2.8",
)  # fmt: skip
"""CodeMirror, the editor of the tab, and what it imports. The page maps names of modules to the copies."""

SEARCH = "iframe-worker@1.0.4"
"""What lets the search of the documentation run from a folder, where browsers refuse workers of files."""

INSTALLED = ROOT / ".venv" / "pyodide"
"""A separate folder, like `codemirror`, because npm removes packages that its command line does not name."""

_TAB_PAGE = ROOT / "plugins" / "pipros-tab" / "src" / "pipros_tab" / "page"
_SERVER_PAGE = ROOT / "packages" / "pipros-server" / "src" / "pipros_server" / "page"
TAB_FILES = (*_TAB_PAGE.iterdir(), ROOT / "docs" / "in-browser" / "start.mjs", _SERVER_PAGE / "dom.js")
"""The page of the tab, and modules of other pages that it uses."""

PYODIDE_FILES = (
    "pyodide.mjs", "pyodide.asm.mjs", "pyodide.asm.wasm", "python_stdlib.zip", "pyodide-lock.json",
)  # fmt: skip
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
    for file in TAB_FILES:
        shutil.copyfile(file, folder / file.name)
    _pack(folder)


def _pack(folder: Path) -> None:
    """Write `FILE.gz` beside each file that compression shrinks by a tenth, for `pipros serve --tab`."""
    for file in [each for each in folder.rglob("*") if each.is_file() and each.suffix != ".gz"]:
        content = file.read_bytes()
        packed = gzip.compress(content, mtime=0)
        if len(packed) < 0.9 * len(content):
            file.with_name(f"{file.name}.gz").write_bytes(packed)


def on_post_build(config: Any) -> None:
    """Add the files to the documentation. MkDocs calls this hook after it has written the pages."""
    write_tab(Path(config["site_dir"], "in-browser"))
    shutil.copy(_installed(SEARCH)[0] / "shim" / "index.js", Path(config["site_dir"], "search", "worker.js"))


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """Load what the search needs from the site; the theme would load it from another server."""
    up = "../" * page.url.count("/")
    return output.replace("https://unpkg.com/iframe-worker/shim", f"{up}search/worker.js")


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
    names = {PACKAGE: "pyodide", SEARCH: "search"}
    prefix = INSTALLED.with_name(names.get(packages[0], "codemirror"))
    folders = [prefix / "node_modules" / each.rpartition("@")[0] for each in packages]
    if not all(map(_is_installed, folders, packages)):
        npm = shutil.which("npm")
        if npm is None:
            raise SystemExit(f"npm is not installed. It is needed to get {', '.join(packages)}.")
        options = ("--no-save", "--no-package-lock", "--silent", "--no-audit", "--no-fund")
        command = (npm, "install", *options, "--prefix", str(prefix), *packages)
        if subprocess.run(command, check=False).returncode:
            raise SystemExit(f"npm cannot install {', '.join(packages)}")
    return folders


def _is_installed(folder: Path, package: str) -> bool:
    about = folder / "package.json"
    version = package.rpartition("@")[2]
    return about.is_file() and f'"version": "{version}"' in about.read_text(encoding="utf-8")


def _build_wheel(path: Path) -> None:
    """Write the wheel of pipros, and the files of those of its plugins, to one archive."""
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as joined:
        for project in (ROOT, *sorted((ROOT / "plugins").iterdir())):
            command = (sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder)
            subprocess.run(command, cwd=project, check=True, capture_output=True)
        for wheel in sorted(Path(folder).glob("*.whl")):
            with zipfile.ZipFile(wheel) as archive:
                for member in archive.infolist():
                    joined.writestr(member, archive.read(member))


if __name__ == "__main__":
    (write_tab if sys.argv[2:] == ["--tab"] else write_files)(Path(sys.argv[1]))
