"""Workspaces of the shapes that public repositories have: the files of their wheels, and what is said."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.wheel_workspace_table import WORKSPACES
from tests.support.wheel_workspaces import build_workspace, expected_files, write_workspace


@pytest.mark.parametrize("name", WORKSPACES)
def test_the_wheels_of_a_workspace_have_exactly_these_files(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    packs = WORKSPACES[name]
    write_workspace(packs, tmp_path)
    found = build_workspace(tmp_path)
    assert found.files == {
        path.rpartition("/")[2]: files
        for path, pack in packs.items()
        if (files := expected_files(path, pack)) is not None
    }
    for path, pack in packs.items():
        said = [line for line in found.said if line.startswith(f"{path.rpartition('/')[2]}: ")]
        wanted = pack.said.split(" | ") if pack.said else []
        assert len(said) == len(wanted), said
        assert all(part in line for part, line in zip(wanted, said, strict=True)), said
