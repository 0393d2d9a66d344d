"""The libraries that the extra `data` installs."""

from __future__ import annotations

from importlib import import_module
from traceback import extract_tb
from typing import Any

from pipros.basics.errors import MissingExtra
from pipros.basics.extras import missing
from pipros.basics.printable import printable


def library(name: str, purpose: str) -> Any:
    """Import a library that the extra installs. `purpose` names the feature that needs it, for errors.

    Raises:
        MissingExtra: the library is not installed. The text says how to install it.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise missing_extra(error, purpose) from error


def missing_extra(error: ImportError, purpose: str) -> MissingExtra:
    """Return an error that names the library of a failed import and the command that installs it."""
    return missing(f"{purpose} needs {error.name or 'a library'}", "pipros-data", error)


def user_library(name: str, purpose: str) -> Any:
    """Import a library that no extra installs.

    Raises:
        MissingExtra: the library, the wanted part of it, or a library that it imports is not installed, or
            importing it fails.
    """
    package = name.partition(".")[0]
    try:
        import_module(package)
        return import_module(name)
    except Exception as error:  # importing runs the library's code
        lacking = (error.name or "") if isinstance(error, ModuleNotFoundError) else ""
        if lacking == package:
            what = f"{package}, which is not installed. Try: pip install {package}"
        elif lacking and f"{name}.".startswith(f"{lacking}."):
            what = f"{lacking}, which the installed {package} lacks. Try: pip install --upgrade {package}"
        else:
            frames = [each for each in extract_tb(error.__traceback__) if each.filename[:1] != "<"]
            place: Any = error if isinstance(error, SyntaxError) else frames[-1]
            reason = printable(f"{type(error).__name__}: {error}", 1000)
            what = f"{package}, which cannot be imported: {reason} ({place.filename}:{place.lineno})"
            what += f". Try: pip install {lacking.partition('.')[0]}" if lacking else ""
        raise MissingExtra(f"{purpose} needs {what}", name=lacking or package) from error
