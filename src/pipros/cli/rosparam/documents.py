"""Parameters as text: YAML documents in, YAML and plain text out. Nothing here talks to a master."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
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
        CommandError: no such file.
        YamlError: the file is no YAML, or more than plain data.
    """
    path = Path(file)
    if not path.is_file():
        raise CommandError(f"file [{file}] does not exist")
    return read_text(path.read_text(encoding="utf-8"), file, ns)


def read_text(text: str, file: str, ns: str) -> list[tuple[Any, str]]:
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


def leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """The single parameters that a value at `name` stands for: dictionaries are namespaces.

    >>> list(leaves("/wheels", {"left": 1, "rear": {"left": 2}}))
    [('/wheels/left', 1), ('/wheels/rear/left', 2)]

    Raises:
        CommandError: a key that is no string.
    """
    if not isinstance(value, Mapping):
        yield name, value
        return
    if not all(isinstance(key, str) for key in value):
        raise CommandError(f"YAML dictionaries must have string keys. Invalid dictionary is:\n{value}")
    for key, part in value.items():
        yield from leaves(join(name, key), part)


def as_yaml(value: Any) -> str:
    """The value as a YAML document of its own; a bare scalar without the `...` that ends it."""
    return dump(value).removesuffix("...\n")


def dump(value: Any) -> str:
    """The value as a YAML document, in block style and with sorted keys."""
    import yaml as pyyaml

    text: str = pyyaml.safe_dump(value)
    return text


def as_pretty_text(tree: Mapping[str, Any], indent: str = "") -> str:
    """A namespace as people like to read it. It is not YAML any more: texts stand there as they are."""
    lines = []
    for key in sorted(tree):
        value = tree[key]
        if isinstance(value, Mapping):
            lines.append(f"{indent}{key}:\n{as_pretty_text(value, indent + '  ')}")
        elif isinstance(value, str) and "\n" in value:
            lines.append(f"{indent}{key}: |\n" + "".join(f"{indent}  {line}\n" for line in value.split("\n")))
        elif isinstance(value, str):
            lines.append(f"{indent}{key}: {value}\n")
        else:
            lines.append(f"{indent}{key}: {as_yaml(value)}")
    return "".join(lines)
