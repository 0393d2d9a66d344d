"""Read a package's `setup.py`: its Python packages, their folders, and its scripts.

As in catkin, a separate interpreter runs the file, and `setup()` only records its arguments. For this, the
modules `setuptools` and `distutils` are replaced. `find_packages` comes from setuptools or, if setuptools is
not installed, is a substitute.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pipros.basics.env import DISTRIBUTION
from pipros.basics.errors import PiprosError

_TIME_LIMIT_S = 60.0

_PROBE = """
import fnmatch, json, os, runpy, sys, types
recorded = {}
def setup(**arguments):
    recorded.update({key: arguments.get(key) for key in ("packages", "package_dir", "scripts", "py_modules")})
def find_packages(where=".", exclude=(), include=("*",)):
    found = []
    for folder, below, files in os.walk(where):
        if folder == where or "__init__.py" in files:
            name = os.path.relpath(folder, where).replace(os.sep, ".")
            if (folder != where and any(fnmatch.fnmatchcase(name, item) for item in include)
                    and not any(fnmatch.fnmatchcase(name, item) for item in exclude)):
                found.append(name)
        else:
            del below[:]
    return found
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
print("\\0" + json.dumps(recorded))
"""


class SetupPyError(PiprosError):
    """A `setup.py` failed or took too long."""


@dataclass(frozen=True, slots=True)
class PythonSetup:
    """Python packages with their folders, and scripts, all as absolute paths."""

    packages: Mapping[str, str]
    scripts: Sequence[str]


def read_setup_py(folder: str, *, limit_s: float = _TIME_LIMIT_S) -> PythonSetup:
    """Run the `setup.py` in a folder; `ROS_DISTRO` and similar variables default to Noetic's values.

    Raises:
        SetupPyError: the file failed or exceeded the time limit. After a failure, the message includes the
            last lines of the error output.
    """
    try:
        ended = subprocess.run(  # noqa: S603
            [sys.executable, "-c", _PROBE],
            cwd=folder,
            env={**DISTRIBUTION, **os.environ},
            capture_output=True,
            text=True,
            timeout=limit_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise SetupPyError(f"{folder}/setup.py did not finish within {limit_s:.0f} s") from None
    if ended.returncode != 0 or "\0" not in ended.stdout:
        last_lines = ended.stderr.strip().splitlines()[-3:]
        raise SetupPyError(f"{folder}/setup.py failed:\n  " + "\n  ".join(last_lines))
    recorded = json.loads(ended.stdout.rpartition("\0")[2])
    folders = recorded.get("package_dir") or {}
    packages = {}
    for name in recorded.get("packages") or []:
        packages[name] = os.path.normpath(os.path.join(folder, _folder_of(name, folders)))
    scripts = [os.path.join(folder, script) for script in recorded.get("scripts") or []]
    return PythonSetup(packages, scripts)


def _folder_of(package: str, folders: Mapping[str, str]) -> str:
    """Return the folder of a Python package according to `package_dir`, as setuptools computes it."""
    parts, below = package.split("."), list[str]()
    while parts:
        known = folders.get(".".join(parts))
        if known is not None:
            return os.path.join(known, *below)
        below.insert(0, parts.pop())
    return os.path.join(folders.get("", ""), *below)
