"""The libraries that the extra `data` installs."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from pipros.basics.errors import MissingExtra
from pipros.basics.extras import missing


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
    return missing(f"{purpose} needs {error.name or 'a library'}", "data", error)


def user_library(name: str, purpose: str) -> Any:
    """Import a library that no extra installs. Raise `MissingExtra` if it is not installed."""
    try:
        return import_module(name)
    except ImportError as error:
        package = name.partition(".")[0]
        what = f"{purpose} needs {package}, which is not installed. Try: pip install {package}"
        raise MissingExtra(what, name=package) from error
