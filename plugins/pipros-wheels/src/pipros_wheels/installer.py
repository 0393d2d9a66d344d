"""Install wheels and their requirements by running pip or uv, which resolves the requirements."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros_wheels.index import read_wheel_name

_QUERY_LIMIT_S = 120.0
_SEPARATOR = re.compile(r"[\s,]")
"""What pip and uv read as the end of a folder in a variable; a URL has it as %20 or %2C."""
_FURTHER_INDEXES = ("PIP_EXTRA_INDEX_URL", "UV_EXTRA_INDEX_URL", "UV_INDEX")


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

    def install(
        self, requirements: Sequence[str], wheels: Mapping[Path, str], only_wheels: Sequence[str] = ()
    ) -> None:
        """Install wheels, then requirements. Blocks; the installer's output is not captured.

        Exactly these wheels are installed. What they require is not looked up anywhere, so the requirements
        must contain what is missing. The wheels replace installed distributions even if the version is the
        same, because ROS packages are often changed without a new version.

        Args:
            wheels: the wheels, each with its SHA-256, or an empty text for a wheel that was just built.
            only_wheels: names of the required distributions whose source archives must not be used.

        Raises:
            InstallFailed: the installer failed.
        """
        same = {file: digest for file, digest in wheels.items() if _is_installed(file)}
        if wheels:
            self._install(["--no-deps", *_words(wheels)])
        if same:
            self._install(["--force-reinstall", "--no-deps", *_words(same)])
        if requirements:
            self._install([*(f"--only-binary={name}" for name in only_wheels), *requirements])

    def _install(self, more: Sequence[str]) -> None:
        words = [*self.command, "install", *self.options(), *more]
        code = subprocess.run(words, env=self.environment(os.environ), check=False).returncode  # noqa: S603
        if code != 0:
            raise InstallFailed(f"[{' '.join(words[:4])} …] failed with exit code {code}")

    def has_wheel(self, requirement: str) -> bool:
        """Return whether the index or the folders have a wheel for a requirement such as `ros1-arm>=1.2`.

        Nothing is installed, and source archives, whose code would have to run, are ignored. Blocks for up to
        two minutes, and returns False after that time.
        """
        words = ["--dry-run", "--no-deps", "--quiet", "--only-binary=:all:", requirement]
        try:
            ended = subprocess.run(  # noqa: S603
                [*self.command, "install", *self.options(), *words],
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
        folders = [
            each.absolute().as_uri() if _SEPARATOR.search(str(each)) else str(each) for each in self.folders
        ]
        found = dict(variables)
        if self.index_url or self.no_index:  # there is no other index
            for name in _FURTHER_INDEXES:
                found.pop(name, None)
        for name, separator in (("PIP_FIND_LINKS", " "), ("UV_FIND_LINKS", ",")):
            found[name] = separator.join(filter(None, [variables.get(name, ""), *folders]))
        return found


def installed_version(distribution: str) -> str | None:
    """Return the version of a distribution in the running environment, or None if it is not installed."""
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return None


def _is_installed(wheel: Path) -> bool:
    """Return whether a wheel's distribution is installed in the running environment in the same version."""
    name, version = read_wheel_name(wheel.name)
    return installed_version(name) == version


def _words(wheels: Mapping[Path, str]) -> list[str]:
    return [f"{file.as_uri()}#sha256={digest}" if digest else str(file) for file, digest in wheels.items()]


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
