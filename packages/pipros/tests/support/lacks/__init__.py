"""Run tests with what another system lacks taken away: `python -m tests.support.lacks windows tests.unit`.

`sitecustomize.py` takes it away, and says what remains as on Linux. Tests whose subject is missing there have
the mark `needs` with a feature of `FEATURES`, and are skipped, as they would be on that system. On Linux,
nothing is skipped.
"""

import os
import sys
from pathlib import Path

import pytest

VARIABLE = "PIPROS_TEST_LACKS"
SYSTEMS = ("macos", "windows")

FEATURES = {
    "/proc": SYSTEMS, "DISPLAY": SYSTEMS, "blocked signals": ("windows",), "executable files": ("windows",),
    "file owners": ("windows",), "first lines": ("windows",), "handled signals": ("windows",),
    "named pipes": ("windows",), "MSG_DONTWAIT": ("windows",), "O_NOFOLLOW": ("windows",),
    "process groups": ("windows",), "pseudo-terminals": ("windows",),
    "programs that replace a process": ("windows",), "resource limits": ("windows",),
    "shared memory": SYSTEMS, "SIGKILL": ("windows",), "timer signals": ("windows",), "Unix sockets": SYSTEMS,
}  # fmt: skip
"""What tests need, and the systems that lack it."""


def system() -> str:
    """Return the system on which tests run, or which is simulated: linux, macos or windows."""
    actual = {"darwin": "macos", "win32": "windows"}.get(sys.platform, "linux")
    return os.environ.get(VARIABLE, actual)


def carried() -> dict[str, str]:
    """Return the variables that a program with its own environment needs; empty outside a simulation."""
    return environment(system()) if is_simulated() else {}


def is_simulated() -> bool:
    """Return whether the lacks of another system are simulated."""
    return VARIABLE in os.environ


def environment(name: str) -> dict[str, str]:
    """Return the variables that simulate a system in a Python process, and in those that it starts."""
    return {VARIABLE: name, "PYTHONPATH": str(Path(__file__).parent)}


def configure(config: pytest.Config) -> None:
    """Register the mark."""
    config.addinivalue_line("markers", "needs(feature): leaves the test out where the system lacks a feature")


def skip_if_missing(item: pytest.Item) -> None:
    """Skip a test if the system lacks what it needs."""
    for mark in item.iter_markers("needs"):
        (feature,) = mark.args
        if system() in FEATURES[feature]:
            pytest.skip(f"needs {feature}, which {system()} lacks")
