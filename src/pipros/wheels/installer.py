"""Install wheels and their requirements by running pip or uv, which resolves the requirements."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.wheels.index import read_wheel_name

_QUERY_LIMIT_S = 120.0


class NoInstaller(PiprosError):
    """Neither pip nor uv can be run."""


class InstallFailed(PiprosError):
    """pip or uv failed; its output says why."""


@dataclass(frozen=True, slots=True)
class Installer:
    """A command that installs distributions into the running Python environment.

    Attributes:
        command: the program and arguments that run pip or uv.
        folders: folders with wheels.
        index_url: the only index to use; empty for the default index of pip or uv.
        no_index: whether to use no index.
    """

    command: tuple[str, ...]
    folders: tuple[Path, ...] = ()
    index_url: str = ""
    no_index: bool = False

    def options(self) -> list[str]:
        """Return the options that tell pip or uv where to find wheels, and uv which environment to use."""
        words = ["--python", sys.executable] if self.command[1:] == ("pip",) else []  # for `uv pip`
        words += ["--no-index"] if self.no_index else []
        words += ["--index-url", self.index_url] if self.index_url else []
        return [*words, *(word for folder in self.folders for word in ("--find-links", str(folder)))]

    def install(self, requirements: Sequence[str], wheels: Sequence[Path] = ()) -> None:
        """Install requirements and built wheels. Blocks; the installer's output is not captured.

        The wheels replace installed distributions even if the version is the same, because ROS packages are
        often changed without a new version.

        Raises:
            InstallFailed: the installer failed.
        """
        same = [file for file in wheels if _is_installed(file)]
        self._install([*map(str, wheels), *requirements])
        if same:
            self._install(["--force-reinstall", "--no-deps", *map(str, same)])

    def _install(self, more: Sequence[str]) -> None:
        words = [*self.command, "install", *self.options(), *more]
        code = subprocess.run(words, env=self.environment(os.environ), check=False).returncode  # noqa: S603
        if code != 0:
            raise InstallFailed(f"[{' '.join(words[:4])} …] failed with exit code {code}")

    def has(self, distribution: str) -> bool:
        """Return whether a distribution is installed, or available in the index or the folders.

        Nothing is installed. Blocks for up to two minutes, and returns False after that time.
        """
        words = [*self.command, "install", *self.options(), "--dry-run", "--no-deps", "--quiet", distribution]
        try:
            ended = subprocess.run(  # noqa: S603
                words,
                env=self.environment(os.environ),
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=_QUERY_LIMIT_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return False
        return ended.returncode == 0

    def environment(self, variables: Mapping[str, str]) -> dict[str, str]:
        """Return the environment for pip and uv, in which isolated builds find pipros in the same folders."""
        folders = list(map(str, self.folders))
        found = dict(variables)
        for name, separator in (("PIP_FIND_LINKS", " "), ("UV_FIND_LINKS", ",")):
            found[name] = separator.join(filter(None, [variables.get(name, ""), *folders]))
        return found


def _is_installed(wheel: Path) -> bool:
    """Return whether a wheel's distribution is installed in the running environment in the same version."""
    name, version = read_wheel_name(wheel.name)[:2]
    try:
        return importlib.metadata.version(name) == version
    except importlib.metadata.PackageNotFoundError:
        return False


def find_installer(name: str = "") -> tuple[str, ...]:
    """Return the command that runs pip or, if pip is not available, uv for the running environment.

    Args:
        name: the only program to use: `pip` or `uv`; empty for either.

    Raises:
        NoInstaller: no such program is available.
    """
    if name in ("", "pip"):
        if importlib.util.find_spec("pip") is not None:
            return (sys.executable, "-m", "pip")
        pip = shutil.which("pip3") or shutil.which("pip")
        if pip is not None:
            return (pip, "--python", sys.executable)
    uv = shutil.which("uv") if name in ("", "uv") else None
    if uv is None:
        raise NoInstaller(
            f"{name or 'neither pip nor uv'} is {'not ' if name else ''}installed;"
            f" python -m {'pip install uv installs uv' if name == 'uv' else 'ensurepip installs pip'}"
        )
    return (uv, "pip")
