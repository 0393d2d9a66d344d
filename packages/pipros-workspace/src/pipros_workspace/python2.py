"""Detect scripts written for Python 2, and explain how to convert them."""

from __future__ import annotations

import ast
import os
import re
import sys
import warnings
from pathlib import Path

from pipros.basics.input_file import open_file

_LIMIT_BYTES = 256 * 1024
_SUSPICIOUS = re.compile(
    rb"^[ \t]*(?:print(?:[ \t]+[^\s(=.,:\[+*/-]|[ \t]*>>)|exec[ \t]+[\w\"']|raise[ \t]+[\w.]+[ \t]*,)"
    rb"|^[^\n#]*(?:<>|`)|^[ \t]*except\b[^\n:(]*,[^\n:]*:|^[ \t]*print[ \t]+\(|\b0[0-7]+\b",
    re.MULTILINE,
)
"""Text that is rare in Python 3. Only files that contain it, or that mix tabs and spaces, are parsed."""

_MIXED = re.compile(rb"^(?: +\t|\t)", re.MULTILINE)
_SPACES = re.compile(rb"^ ", re.MULTILINE)


_PYTHON = min(sys.version_info[:2], (3, 13))
"""The Python version whose grammar is used to parse scripts.

Not 3.14 or later, in which `except ValueError, error:` is valid, with another meaning than in Python 2.
"""


def python2_advice(file: str | os.PathLike[str]) -> str | None:
    """Return one line that says how to convert a Python 2 script; None for other files.

    The file is parsed, not run. If it is a script of a devel space, it stands for the script that it runs.
    """
    from pipros_workspace.client_library import relayed_script

    file = relayed_script(Path(file))
    try:
        with open_file(file) as script:
            text = script.read(_LIMIT_BYTES + 1)
    except OSError:
        return None
    is_mixed = bool(_MIXED.search(text) and _SPACES.search(text))
    if len(text) > _LIMIT_BYTES or b"\0" in text or not (is_mixed or _SUSPICIOUS.search(text)):
        return None
    error = _syntax_error(text)
    if error is None:
        return None
    untab = f"expand -t 8 {file} > /tmp/script.py && cat /tmp/script.py > {file}"
    if isinstance(error, TabError):
        if _syntax_error(text.expandtabs(8)) is None:
            return f"{file}:{error.lineno} mixes tabs and spaces, as only Python 2 allows: {untab}"
    elif not _SUSPICIOUS.search(text):
        return None
    first = f"{untab}; " if is_mixed else ""
    return (
        f"{file}:{error.lineno} is Python 2, and Noetic runs Python 3: {first}"
        f"pip install fissix && python -m fissix -w {file} (with Python 3.10 to 3.13)"
    )


def _syntax_error(text: bytes) -> SyntaxError | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            ast.parse(text, feature_version=_PYTHON)
    except SyntaxError as error:
        return error
    except (ValueError, RecursionError, MemoryError):
        return None
    return None
