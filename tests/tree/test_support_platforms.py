"""The comparison of pyright's errors between systems."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.platforms import additional_errors, files_with_differences
from tests.support.pyright import INSTALL, find_pyright

PROGRAM = """
import os
import socket
import sys

import no_such_module

os.getuid()
socket.TCP_INFO
if sys.platform != "win32":
    os.killpg(1, 2)
"""


@pytest.mark.timeout(180)
def test_only_names_that_another_system_lacks_are_reported(tmp_path: Path) -> None:
    if find_pyright() is None:
        pytest.skip(f"pyright is not on this machine: {INSTALL}")
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)

    found = additional_errors([program])

    lines = {platform: [error.line for error in errors] for platform, errors in found.items()}
    assert lines == {"Darwin": [9], "Windows": [8, 9]}
    assert '"TCP_INFO" is not a known attribute' in str(found["Darwin"][0])
    assert str(found["Darwin"][0]).startswith(f"{program}:9: ")


@pytest.mark.parametrize(
    ("text", "is_checked"),
    [
        ("import os\n", True),
        ("def read() -> None:\n    import fcntl\n", True),
        ("import sys, signal\n", True),
        ("from socket import TCP_INFO\n", True),
        ("import os.path as paths\n", True),
        ("import json\n", False),
        ("from pathlib import Path\n", False),
        ("import osmosis\n", False),
    ],
)
def test_files_that_import_a_module_with_differences_are_checked(
    text: str, is_checked: bool, tmp_path: Path
) -> None:
    file = tmp_path / "program.py"
    file.write_text(text)
    assert files_with_differences(tmp_path) == [file] * is_checked
