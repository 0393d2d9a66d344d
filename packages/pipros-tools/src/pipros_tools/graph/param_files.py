"""Parse parameter files (YAML documents). No master is needed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pipros.basics import input_file
from pipros.basics.names import is_private, join
from pipros.safe.yaml import load, load_all
from pipros_tools.graph.errors import GraphError

NAMESPACE_KEY = "_ns"
"""Key for the namespace of a document's values, relative to the requested namespace."""


def read_file(file: str, ns: str) -> list[tuple[Any, str]]:
    """Return the documents in a file, each with its namespace.

    Raises:
        GraphError: the file does not exist or cannot be read, or the namespace of a document is private.
        YamlError: the file is not valid YAML, or not plain data.
    """
    path = Path(file)
    if not path.is_file():
        raise GraphError(f"file [{file}] does not exist")
    try:
        content = input_file.read_file(path)
    except OSError as error:
        raise GraphError(f"cannot read [{file}]: {error.strerror}") from None
    return read_text(content, file, ns)


def read_text(text: str | bytes, file: str, ns: str) -> list[tuple[Any, str]]:
    """Like `read_file`, but parse a string. `file` is the name to use in error messages."""
    documents = []
    for document in load_all(text, file):
        own_ns = document.pop(NAMESPACE_KEY, None) if isinstance(document, dict) else None
        if document is not None:
            documents.append((document, ns if own_ns is None else _below(ns, str(own_ns))))
    return documents


def _below(ns: str, name: str) -> str:
    if is_private(name):
        raise GraphError(f"the namespace [{name}] of a parameter file cannot be private")
    return join(ns, name)


def parse_value(text: str, name: str) -> Any:
    """Parse a YAML value from the command line. If the text is empty, return an empty string.

    Raises:
        YamlError: the text is not valid YAML, or not plain data.
    """
    return load(text, f"the value of {name}") if text else ""
