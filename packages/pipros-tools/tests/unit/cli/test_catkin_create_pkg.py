from __future__ import annotations

from pathlib import Path

import pytest

from pipros_tools.cli import catkin_create_pkg


@pytest.mark.parametrize(("arguments", "message"), [
    (["a", "-V", "bad"], 'Package version "bad" does not follow version conventions'),
    (["a/b"], 'Package name "a/b" does not follow naming conventions'),
    (["a", "a"], 'The package "a" must not'),
])  # fmt: skip
def test_a_package_that_cannot_be_made_is_reported_in_one_line(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert catkin_create_pkg.main(arguments) == 1
    assert capsys.readouterr().err.startswith(f"catkin_create_pkg: error: {message}")
    assert list(tmp_path.iterdir()) == []
