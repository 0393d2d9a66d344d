"""A made-up Debian: folders that take the place of `/usr/share` and `/usr/lib`."""

from pathlib import Path
from typing import NamedTuple

import pytest

PROGRAM_OF_ROSCPP = b"\x7fELF\0 libroscpp.so.4 \0"
OTHER_PROGRAM = b"\x7fELF\0 libc.so.6 \0"


class DebianSystem(NamedTuple):
    """The folders, and methods that install packages into them."""

    share: Path
    lib: Path

    def add_manifest(self, name: str) -> Path:
        """Install a package's manifest, and return the package's folder."""
        folder = self.share / name
        folder.mkdir()
        (folder / "package.xml").write_text(f"<package><name>{name}</name></package>")
        return folder

    def add_program(self, package: str, name: str, content: bytes = PROGRAM_OF_ROSCPP) -> Path:
        """Install a program, and return its path."""
        program = self.lib / package / name
        program.parent.mkdir(exist_ok=True)
        program.write_bytes(content)
        program.chmod(0o755)
        return program


def make_debian(folder: Path, monkeypatch: pytest.MonkeyPatch) -> DebianSystem:
    """Create the folders, and make this process use them in place of the machine's, also on Windows."""
    system = DebianSystem(folder / "usr" / "share", folder / "usr" / "lib")
    system.share.mkdir(parents=True)
    system.lib.mkdir()
    monkeypatch.setattr("pipros.packages.system_packages.ON_WINDOWS", False)
    monkeypatch.setattr("pipros.packages.system_packages.SYSTEM_SHARE", str(system.share))
    monkeypatch.setattr("pipros.packages.system_packages.PROGRAM_FOLDER", str(system.lib))
    return system
