"""The `pipros` command."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros import __version__
from pipros.cli.pipros import main


def test_it_says_what_it_can_do(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert "pipros stubs" in capsys.readouterr().out
    assert main(["nonsense"]) == 64


def test_it_says_its_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"{__version__}\n"


def test_stubs_are_written_where_editors_look(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["stubs", "std_srvs"]) == 0
    assert capsys.readouterr().out.split() == [
        "typings/std_srvs/srv/__init__.pyi",
        "typings/std_srvs/__init__.pyi",
    ]
    text = (tmp_path / "typings" / "std_srvs" / "srv" / "__init__.pyi").read_text()
    assert "class SetBoolRequest(_base.Message):\n" in text
    assert "\n    data: bool\n" in text
