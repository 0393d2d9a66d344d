"""Types say something: the word `Any` is rare in each package of pipros."""

from __future__ import annotations

import re

from tests.support.environments import SRC, files_below

MOST = 30
"""`Any` per 1,000 lines of a package."""

HIGHER = {"reconfigure": 62, "safe": 80}
"""Packages with more, because they read values of any type. Lower a figure if there are fewer."""


def rates() -> dict[str, float]:
    """Return the number of `Any` per 1,000 lines, by package."""
    counts: dict[str, list[int]] = {}
    for file in files_below(SRC / "pipros", "*.py"):
        package, *inner = file.relative_to(SRC / "pipros").parts
        if inner and package != "share":
            text = file.read_text(encoding="utf-8")
            count = counts.setdefault(package, [0, 0])
            count[0] += len(re.findall(r"\bAny\b", text))
            count[1] += text.count("\n")
    return {package: 1000 * found / max(lines, 1) for package, (found, lines) in counts.items()}


def test_any_is_rare_in_each_package() -> None:
    found = rates()
    assert {name: rate for name, rate in found.items() if rate > HIGHER.get(name, MOST)} == {}
    assert [name for name in HIGHER if name in found and found[name] <= MOST] == []
