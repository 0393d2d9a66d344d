"""tf_conversions and tf2_kdl without PyKDL."""

from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    ("package", "program"),
    [
        (
            "tf_conversions",
            "import tf_conversions\ntf_conversions.fromTf(((1, 2, 3), (0, 0, 0, 1)))",
        ),
        ("tf2_kdl", "import tf2_kdl"),
    ],
)
def test_without_pykdl_the_error_says_what_to_install(package: str, program: str) -> None:
    program = f"import sys; sys.modules['PyKDL'] = None\n{program}"

    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)

    assert f"{package} needs PyKDL" in ended.stderr
    assert "python3-pykdl" in ended.stderr
