"""Recordings for tests that compare nodes of pipros with what genuine ones answered."""

from collections.abc import Generator
from pathlib import Path

import pytest

from tests.support.recordings import Recording, file_of


@pytest.fixture
def recording(request: pytest.FixtureRequest, tmp_path: Path) -> Recording:
    """What the genuine node answered to the inputs of the test."""
    return Recording(file_of(request.node.nodeid), tmp_path)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Function) -> Generator[None, None, None]:
    """Let a test fail that passed, but left out a part of its recording."""
    yield
    recording = item.funcargs.get("recording")
    if isinstance(recording, Recording):
        recording.finish()
