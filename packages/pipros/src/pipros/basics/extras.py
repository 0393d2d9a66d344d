"""Explain how to add an optional dependency to this installation of pipros."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from pipros.basics.errors import MissingExtra

# All nodes and commands import this module, so each function imports the modules that only it needs.


def install_command(*wanted: str) -> str:
    """Return the command that adds extras or plugins of pipros to this environment.

    The command installs from the same folder, file or repository as before, because a package index may not
    contain pipros, or may contain a different version.

    Args:
        wanted: names of extras of pipros, or one plugin, as `pipros-fleet` or `pipros-ros2[zenoh]`.
    """
    origin = _origin()
    is_plugin = wanted[0].startswith("pipros-")
    named = _plugin(wanted[0], origin) if is_plugin else _requirement(",".join(wanted), origin)
    return f"{_pip()} install {named}"


def required(module: str, what: str, extra: str) -> Any:
    """Import and return an optional library. `what` is the start of the error text, as for `missing`.

    Raises:
        MissingExtra: the library is missing or cannot be imported.
    """
    from importlib import import_module

    try:
        return import_module(module)
    except ImportError as error:
        raise missing(what, extra, error) from error


def optional(module: str) -> Any:
    """Import and return a library, or return None if it is missing or cannot be imported."""
    from importlib import import_module

    try:
        return import_module(module)
    except ImportError as error:
        _check_no_interrupt(error)
        return None


def missing(what: str, extra: str, error: ImportError) -> MissingExtra:
    """Return the error for an optional library that is missing or cannot be imported.

    `what` is the start of the error text. It ends with the library's name, as in `images and cameras need
    numpy`.

    Raises:
        KeyboardInterrupt: Ctrl-C interrupted the import.
    """
    _check_no_interrupt(error)
    is_absent = isinstance(error, ModuleNotFoundError) and error.name is not None
    problem = "is not installed" if is_absent else f"cannot be imported: {error}"
    return MissingExtra(f"{what}, which {problem}. Try: {install_command(extra)}", name=error.name)


def _check_no_interrupt(error: ImportError) -> None:
    """Raise KeyboardInterrupt if Ctrl-C interrupted the import of numpy, or of what needs it.

    In this case, numpy's C code prints the exception, which sets `sys.last_type`, and raises ImportError.
    """
    if error.name is None and getattr(sys, "last_type", None) is KeyboardInterrupt:
        raise KeyboardInterrupt from None


def _pip() -> str:
    """Return `pip` if it runs this environment's pip; otherwise a command that does."""
    import shutil

    from pipros.basics.words import quoted

    folder = Path(sys.executable).parent
    found = shutil.which("pip")
    return "pip" if found and Path(found).parent == folder else f"{quoted(sys.executable)} -m pip"


def _origin() -> dict[str, Any]:
    """Return pip's record of where pipros was installed from (PEP 610).

    The record is empty if the source was a package index or is unknown.
    """
    import json
    from importlib.metadata import PackageNotFoundError, distribution

    try:
        noted = json.loads(distribution("pipros").read_text("direct_url.json") or "{}")
    except (PackageNotFoundError, ValueError, RecursionError):
        return {}
    return noted if isinstance(noted, dict) and isinstance(noted.get("url"), str) else {}


def _plugin(name: str, origin: dict[str, Any]) -> str:
    """Return the requirement of a plugin: beside the pipros that is installed, if this has a known place."""
    from pipros.basics.words import quoted

    distribution, bracket, extras = name.partition("[")
    folder = f"plugins/{distribution}"
    if "vcs_info" in origin:
        return quoted(f"{name} @ {_repository(origin)}#subdirectory={folder}")
    place = _place(origin.get("url", ""))
    if place is None or not Path(place, folder).is_dir():
        return quoted(name)
    path = quoted(f"{Path(place, folder)}{bracket}{extras}")
    return f"--editable {path}" if origin.get("dir_info", {}).get("editable") else path


def _repository(origin: dict[str, Any]) -> str:
    noted = origin["vcs_info"]
    return f"{noted.get('vcs')}+{origin['url']}@{noted.get('commit_id')}"


def _place(url: str) -> str | None:
    """Return the path of the folder or file that a URL names, or None if it names none that is there."""
    from urllib.parse import unquote

    from pipros.basics.windows import path_of_url

    if not url.startswith("file:"):
        return None
    place = path_of_url(unquote(url))
    return place if Path(place).exists() else None


def _requirement(extras: str, origin: dict[str, Any]) -> str:
    from pipros.basics.words import quoted

    name, url = f"pipros[{extras}]", origin.get("url", "")
    if "vcs_info" in origin:
        return quoted(f"{name} @ {_repository(origin)}")
    if not url.startswith("file:"):
        return quoted(f"{name} @ {url}" if url else name)
    place = _place(url)
    if place is None:
        return quoted(name)
    if origin.get("dir_info", {}).get("editable"):
        return f"--editable {quoted(f'{place}[{extras}]')}"
    return quoted(f"{name} @ {url}")
