"""roslaunch: a file that includes itself had no end, and files of other encodings could not be read."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.ros import RosSystem

LAUNCH = '<launch><param name="name" value="küche"/></launch>'


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "iso-8859-1"])
def test_a_launch_file_may_have_any_declared_encoding(encoding: str, ros: RosSystem, tmp_path: Path) -> None:
    file = tmp_path / "a.launch"
    declared = encoding.removesuffix("-sig").upper()
    file.write_bytes(f'<?xml version="1.0" encoding="{declared}"?>\n{LAUNCH}'.encode(encoding))
    found = ros.pipros.run("roslaunch", "--dump-params", str(file))
    assert found.output.strip() == "/name: küche"


def test_files_that_include_each_other_are_an_error(ros: RosSystem, tmp_path: Path) -> None:
    for name, other in ("ab", "ba"):
        include = f'<launch><include file="$(dirname)/{other}.launch"/></launch>'
        (tmp_path / f"{name}.launch").write_text(include)
    found = ros.pipros.run("roslaunch", "--nodes", str(tmp_path / "a.launch"))
    assert found.returncode == 1
    assert "is there a cycle?" in found.output
    assert "Traceback" not in found.output
