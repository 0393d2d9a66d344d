"""Limit waits for a master in pytest, where an endless wait would only block the test run."""

from __future__ import annotations

import os
import time
from typing import Final

from pipros.basics.errors import PiprosError

PYTEST_WAIT_S: Final = 10.0
"""How long a node in pytest waits for a master. A test may start its master at the same time as its node."""

ANSWER_LIMIT_S: Final = 10.0
"""How long one call waits for the master's response. A busy or suspended master is called again."""

_ADVICE = (
    "Use the fixture ros_master, or set ROS_MASTER_URI to a running master. If a launch file runs this "
    "program as <test>, give pytest the launch file"
)


class NoMaster(PiprosError):
    """No master responded to a program in pytest."""


class MasterWait:
    """A wait for the master: endless, except in pytest."""

    def __init__(self) -> None:
        self._began = time.monotonic()

    def check(self, error: Exception) -> None:
        """Return if the wait should continue after the master failed to respond with `error`.

        Raises:
            NoMaster: the process runs pytest, and the master has not responded since the wait
                began, `PYTEST_WAIT_S` ago.
        """
        limit_s = pytest_wait_s()
        if limit_s is not None and time.monotonic() - self._began >= limit_s:
            raise NoMaster(f"no master responded to pytest within {limit_s:g} s: {error}. {_ADVICE}")


def pytest_wait_s() -> float | None:
    """Return `PYTEST_WAIT_S` if pytest, with pipros's plugin, runs in this process; otherwise None."""
    return PYTEST_WAIT_S if os.environ.get("PIPROS_PYTEST") == str(os.getpid()) else None
