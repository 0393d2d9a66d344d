from __future__ import annotations

from pathlib import Path

import pytest

from pipros_workspace.pkg_config import NoFlags, flags


def pkg_config(folder: Path, monkeypatch: pytest.MonkeyPatch, answer: str, code: int = 0) -> None:
    """A program of that name with this output, the only one in PATH."""
    folder.mkdir()
    stream = ">&2" if code else ""
    (folder / "pkg-config").write_text(f"#!/bin/sh\nprintf '%s\\n' '{answer}' {stream}\nexit {code}\n")
    (folder / "pkg-config").chmod(0o755)
    monkeypatch.setenv("PATH", str(folder))


@pytest.mark.needs("first lines")
def test_folders_of_overlays_come_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    prefixes = [tmp_path / "upper", tmp_path / "lower"]
    for prefix in prefixes:
        prefix.mkdir()
        (prefix / ".catkin").touch()
    monkeypatch.setenv("CMAKE_PREFIX_PATH", ":".join(map(str, prefixes)))
    folders = ["/usr/include", f"{prefixes[1]}/include", f"{prefixes[0]}/include", f"{prefixes[0]}2/include"]
    pkg_config(tmp_path / "bin", monkeypatch, " ".join(f"-I{folder}" for folder in folders))
    assert flags("p", "cflags-only-I", "-I") == [folders[2], folders[1], folders[0], folders[3]]


@pytest.mark.needs("first lines")
def test_other_flags_keep_their_order_and_prefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pkg_config(tmp_path / "bin", monkeypatch, "-pthread -DX=1  -DA")
    assert flags("p", "cflags-only-other") == ["-pthread", "-DX=1", "-DA"]


@pytest.mark.needs("first lines")
def test_a_failed_query_names_the_query_and_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pkg_config(tmp_path / "bin", monkeypatch, "Package p was not found.", code=1)
    with pytest.raises(NoFlags, match=r"'pkg-config --libs-only-l p' failed: Package p was not found\."):
        flags("p", "libs-only-l", "-l")
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(NoFlags, match="pkg-config is not installed"):
        flags("p", "libs-only-l", "-l")
