"""Wheels for tests with pip: of pipros, and of what it requires, made from the running environment."""

import importlib.metadata
import os
import re
import subprocess
import sys
import venv
from collections.abc import Iterator
from pathlib import Path

from pipros_wheels.archive import ArchiveEntry, write_wheel
from pipros_wheels.names import escaped
from tests.support.environments import REPOSITORY


def build_pipros(folder: Path, *plugins: str) -> Path:
    """Build the wheels of pipros, of pipros-wheels and of other plugins. Return the path of the first."""
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    for project in (".", *(f"plugins/{plugin}" for plugin in ("pipros-wheels", *plugins))):
        subprocess.run(build, cwd=REPOSITORY / project, check=True, capture_output=True)
    (made,) = folder.glob("pipros-*.whl")
    return made


def requirements(name: str) -> Iterator[str]:
    """Return the distributions that a distribution requires, without its extras."""
    for line in importlib.metadata.requires(name) or ():
        if "extra ==" not in line and (found := re.match(r"[\w.-]+", line)):
            yield found[0]


def repack_requirements(name: str, folder: Path) -> None:
    """Write wheels of the installed distributions that a distribution requires, without a download."""
    for needed in requirements(name):
        try:
            distribution = importlib.metadata.distribution(needed)
        except importlib.metadata.PackageNotFoundError:
            continue  # for another Python or system
        if not list(folder.glob(f"{escaped(needed)}-*.whl")):
            _repack(distribution, folder)
            repack_requirements(needed, folder)


def _repack(distribution: importlib.metadata.Distribution, folder: Path) -> None:
    tags = re.findall(r"^Tag: (\S+)$", distribution.read_text("WHEEL") or "", re.MULTILINE)
    python = {tag.split("-")[0] for tag in tags}
    tag = tags[0] if len(tags) == 1 or len(python) < 2 else f"{'.'.join(sorted(python))}-none-any"
    entries, info = {}, ""
    for file in distribution.files or ():
        path = Path(str(distribution.locate_file(file)))
        if ".." in file.parts or file.suffix == ".pyc" or not path.is_file():
            continue
        if file.parts[0].endswith(".dist-info"):
            info = file.parts[0]
            if file.name in ("RECORD", "INSTALLER", "REQUESTED", "direct_url.json"):
                continue
        entries[str(file)] = ArchiveEntry(path)
    name = f"{escaped(distribution.metadata['Name'])}-{distribution.version}-{tag}.whl"
    write_wheel(folder / name, entries, info)


class Installed:
    """A new virtual environment with pip of the running environment, and no index but a folder."""

    def __init__(self, folder: Path, wheels: Path, home: Path) -> None:
        self.folder = folder
        self.wheels = wheels
        venv.create(folder, with_pip=False, symlinks=True)
        self.programs = folder / "bin"
        self.variables = {
            "PATH": f"{self.programs}{os.pathsep}/usr/bin{os.pathsep}/bin", "HOME": str(home),
            "PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(wheels), "PIP_DISABLE_PIP_VERSION_CHECK": "1",
            "PIP_NO_COMPILE": "1", "PIP_CACHE_DIR": str(home / "cache"), "LANG": "C.UTF-8",
        }  # fmt: skip

    def pip(self, *words: str | Path, code: int = 0, **variables: str) -> str:
        """Run pip, and return its output."""
        command = [sys.executable, "-m", "pip", "--python", str(self.programs / "python"), *map(str, words)]
        return self._run(command, code, variables)

    def run(self, *words: str | Path, code: int = 0, **variables: str) -> str:
        """Run a program of the environment, and return its output."""
        return self._run(list(map(str, words)), code, variables)

    def shell(self, commands: str, *, folder: Path, is_bare: bool = False) -> str:
        """Run commands in bash, each of which must succeed, and return their output.

        Args:
            is_bare: whether the variables of pip that name the folder of wheels are not set.
        """
        tools = self.folder.parent / f"tools-{self.folder.name}"
        if not tools.exists():
            tools.mkdir()
            pip = f'#!/bin/sh\nexec {sys.executable} -m pip --python {self.programs / "python"} "$@"\n'
            (tools / "pip").write_text(pip)
            (tools / "pip").chmod(0o755)
        variables = {name: "" for name in ("PIP_NO_INDEX", "PIP_FIND_LINKS") if is_bare}
        variables["PATH"] = f"{tools}{os.pathsep}{self.variables['PATH']}"
        return self._run(["bash", "-euc", commands], 0, variables, folder)

    def _run(
        self, command: list[str], code: int, variables: dict[str, str], folder: Path | None = None
    ) -> str:
        ended = subprocess.run(
            command, env={name: value for name, value in {**self.variables, **variables}.items() if value},
            cwd=folder or self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        assert ended.returncode == code, f"{' '.join(command)}\n{ended.stdout}"
        return ended.stdout

    def files(self) -> set[str]:
        """Return the paths of all files, without compiled Python."""
        found = (file for file in self.folder.rglob("*") if "__pycache__" not in file.parts)
        return {str(file.relative_to(self.folder)) for file in found if not file.is_dir()}
