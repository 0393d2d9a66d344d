"""Modules that an agent imports."""

from __future__ import annotations

import subprocess
import sys


def test_an_agent_does_not_load_the_page() -> None:
    code = "import sys, pipros_fleet.serve; print([each for each in sys.modules if 'pipros_page' in each])"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout.strip() == "[]"
