"""A folder of bags for assistants, beside files that they must not read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.support.bags import bag_bytes, some_rows

if TYPE_CHECKING:
    from tests.support.assistants import LocalAssistant

NOBODY = "http://127.0.0.1:1"
SECRET = "the content of another file"  # noqa: S105


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "secret.bag").write_text(SECRET)
    (tmp_path / "secret.csv").write_text(SECRET)
    bags = tmp_path / "bags"
    bags.mkdir()
    (bags / "run.bag").write_bytes(bag_bytes(some_rows()))
    (bags / "link.bag").symlink_to(tmp_path / "secret.bag")
    return bags


@pytest.fixture
def assistant(folder: Path) -> LocalAssistant:
    from tests.support.assistants import LocalAssistant  # needs mcp, which not all installations have

    return LocalAssistant(NOBODY, folder)
