"""tf_conversions without PyKDL."""

from __future__ import annotations

import subprocess
import sys


def test_without_pykdl_the_error_says_what_to_install() -> None:
    program = (
        "import sys; sys.modules['PyKDL'] = None\n"
        "import tf_conversions\ntf_conversions.fromTf(((1, 2, 3), (0, 0, 0, 1)))"
    )

    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)

    assert "tf_conversions needs PyKDL" in ended.stderr
    assert "python3-pykdl" in ended.stderr
