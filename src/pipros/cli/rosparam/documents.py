"""Parameter files: YAML documents, and the parameters that they stand for. Nothing here talks to a master."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pipros.cli.program import CommandError
from pipros.names import is_private, join
from pipros.safe.yaml import load_all

NAMESPACE_KEY = "_ns"
"""A key of a document that says into which namespace, below the one asked for, its values go."""


def read_file(file: str, ns: str) -> list[tuple[Any, str]]:
    """The documents of a file, each with the namespace that it belongs to.

    Raises:
        CommandError: no such file, or it cannot be read.
        YamlError: the file is no YAML, or more than plain data.
    """
    path = Path(file)
    if not path.is_file():
        raise CommandError(f"file [{file}] does not exist")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise CommandError(f"cannot read [{file}]: {error.strerror}") from None
    return read_text(content, file, ns)


def read_text(text: str | bytes, file: str, ns: str) -> list[tuple[Any, str]]:
    """As `read_file`; `file` only names the text in errors."""
    documents = []
    for document in load_all(text, file):
        own_ns = document.pop(NAMESPACE_KEY, None) if isinstance(document, dict) else None
        if document is not None:
            documents.append((document, ns if own_ns is None else _below(ns, str(own_ns))))
    return documents


def _below(ns: str, name: str) -> str:
    if is_private(name):
        raise CommandError(f"the namespace [{name}] of a parameter file cannot be private")
    return join(ns, name)
