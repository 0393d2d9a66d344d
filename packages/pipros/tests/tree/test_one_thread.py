"""How Python runs without threads is known to one module, whose functions the others call."""

from __future__ import annotations

import re

from tests.support.environments import REPOSITORY


def test_only_one_module_of_the_core_knows_whether_there_are_turns() -> None:
    files = [file for part in ("src", "facades") for file in REPOSITORY.glob(f"packages/*/{part}/**/*.py")]
    found = [file.name for file in files if re.search(r"\bone_thread\.turns\b", file.read_text())]
    assert len(files) > 1000
    assert found == []
