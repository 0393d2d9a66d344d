"""What a package's `setup.py` says: its Python packages, where they are, and its scripts.

The file is run, as catkin runs it, by an interpreter of its own in which `setup()` only notes its
arguments. `distutils` is stood in for, because newer Pythons have none.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pipros.errors import PiprosError

_TIME_LIMIT_S = 60.0

_PROBE = """
import json, runpy, sys, types
noted = {}
def setup(**arguments):
    noted.update({key: arguments.get(key) for key in ("packages", "package_dir", "scripts", "py_modules")})
def find_packages(*_, **__):
    return []
try:
    from setuptools import find_packages
except ImportError:
    pass
for name in ("distutils", "distutils.core", "setuptools"):
    module = types.ModuleType(name)
    module.setup, module.find_packages = setup, find_packages
    module.__path__ = []
    sys.modules[name] = module
sys.modules["distutils"].core = sys.modules["distutils.core"]
sys.argv = ["setup.py", "--version"]
sys.path.insert(0, ".")
runpy.run_path("setup.py", run_name="__main__")
print("\\0" + json.dumps(noted))
"""


class SetupPyError(PiprosError):
    """A `setup.py` failed, or says what catkin cannot do."""


@dataclass(frozen=True, slots=True)
class PythonSetup:
    """Python packages with their folders, and scripts, all as absolute paths."""

    packages: Mapping[str, str]
    scripts: Sequence[str]


def read_setup_py(folder: str) -> PythonSetup:
    """Runs the `setup.py` in a folder.

    Raises:
        SetupPyError: with its last words.
    """
    try:
        ended = subprocess.run(  # noqa: S603
            [sys.executable, "-c", _PROBE],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=_TIME_LIMIT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise SetupPyError(f"{folder}/setup.py did not end within {_TIME_LIMIT_S:.0f} s") from None
    if ended.returncode != 0 or "\0" not in ended.stdout:
        last_words = ended.stderr.strip().splitlines()[-3:]
        raise SetupPyError(f"{folder}/setup.py failed:\n  " + "\n  ".join(last_words))
    noted = json.loads(ended.stdout.rpartition("\0")[2])
    folders = noted.get("package_dir") or {}
    packages = {}
    for name in noted.get("packages") or []:
        place = folders.get(name) or os.path.join(folders.get("", ""), *name.split("."))
        packages[name] = os.path.normpath(os.path.join(folder, place))
    scripts = [os.path.join(folder, script) for script in noted.get("scripts") or []]
    return PythonSetup(packages, scripts)
