"""Types say something: the word `Any` is rare in each package of pipros."""

from __future__ import annotations

import re

from tests.support.environments import FLOORS, files_below, source
from tests.tree.test_layering import package_of

MOST = 30
"""`Any` per 1,000 lines of a package."""

HIGHER = {"pipros_libraries": 31, "safe": 80}
"""Packages with more, because they read values of any type. Lower a figure if there are fewer."""


def rates() -> dict[str, float]:
    """Return the number of `Any` per 1,000 lines, by package."""
    counts: dict[str, list[int]] = {}
    for floor, file in ((top, file) for top in FLOORS for file in files_below(source(top), "*.py")):
        package = floor if floor == "pipros_libraries" else package_of(file)
        if "share" not in file.parts:
            text = file.read_text(encoding="utf-8")
            count = counts.setdefault(package, [0, 0])
            count[0] += len(re.findall(r"\bAny\b", text))
            count[1] += text.count("\n")
    return {package: 1000 * found / max(lines, 1) for package, (found, lines) in counts.items()}


def test_any_is_rare_in_each_package() -> None:
    found = rates()
    assert {name: rate for name, rate in found.items() if rate > HIGHER.get(name, MOST)} == {}
    assert [name for name in HIGHER if name in found and found[name] <= MOST] == []
