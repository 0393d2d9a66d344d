"""catkin: a setup.py that ended by sys.exit() made its package fail, and the reason was empty."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros_workspace.setup_py import SetupPyError, read_setup_py

SETUP = "import sys\nfrom setuptools import setup\nsetup(packages=['p'])\nsys.exit({})\n"


@pytest.mark.parametrize("status", ["", "0", "None"])
def test_a_setup_that_exits_without_an_error_is_read(status: str, tmp_path: Path) -> None:
    (tmp_path / "setup.py").write_text(SETUP.format(status))
    assert list(read_setup_py(str(tmp_path)).packages) == ["p"]


def test_a_setup_that_exits_with_an_error_and_no_text_has_a_reason(tmp_path: Path) -> None:
    (tmp_path / "setup.py").write_text(SETUP.format("3"))
    with pytest.raises(SetupPyError, match=r"setup\.py failed:\n  it ended with exit status 3"):
        read_setup_py(str(tmp_path))
