"""What was done by hand for benchmarks/port_drafts.py fits the drafts of today."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.environments import PACKAGES, benchmark


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git")
def test_the_finished_drafts_are_those_of_today(tmp_path: Path) -> None:
    program = "import sys, port_drafts, pathlib; port_drafts.write_drafts(pathlib.Path(sys.argv[1]))"
    patch = benchmark("finished_drafts.patch")
    path = os.pathsep.join(str(package / "benchmarks") for package in PACKAGES)  # they import each other
    subprocess.run(
        [sys.executable, "-c", program, tmp_path], env={**os.environ, "PYTHONPATH": path}, check=True
    )

    check = ("git", "apply", "--check", "--unidiff-zero", patch)
    result = subprocess.run(check, cwd=tmp_path / "drafts", capture_output=True, text=True, check=False)

    assert (result.returncode, result.stderr) == (0, "")
