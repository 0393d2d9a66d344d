"""The files that run pipros in a browser."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY
from tests.support.once import make_once, shared_folder


@pytest.fixture(scope="session")
def pyodide_files(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    """Return the folder with Pyodide, which one worker may install from npm, and the wheel of this tree."""
    folder = shared_folder(tmp_path_factory, worker_id) / "pyodide-files"
    command = (
        sys.executable, str(REPOSITORY / "plugins/pipros-tab/tests/support/pyodide_files.py"), str(folder),
    )  # fmt: skip
    return make_once(folder, lambda: subprocess.run(command, check=True))
