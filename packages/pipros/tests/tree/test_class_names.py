"""A public class has a name of its own: who looks for `Source` finds one class."""

from __future__ import annotations

import ast
from collections import defaultdict

from tests.support.environments import SOURCES, import_path, source_files
from tests.support.trees import nodes_of, parsed


def test_public_classes_of_the_library_have_different_names() -> None:
    found: dict[str, list[str]] = defaultdict(list)
    for file in source_files():
        if any(file.is_relative_to(folder) for folder in SOURCES):
            for node in nodes_of(parsed(file)):
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    found[node.name].append(str(import_path(file)))
    assert len(found) > 1500
    assert {name: files for name, files in found.items() if len(files) > 1} == {}
