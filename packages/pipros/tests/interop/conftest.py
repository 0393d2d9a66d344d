"""Fixtures for tests with genuine ROS 1 on the other side."""

import pytest

from tests.interop.fixtures import *  # noqa: F403
from tests.support.ros import Side


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Give genuine programs, and their builds, time on a busy machine."""
    for item in items:
        if "/pipros/tests/interop/" in item.nodeid and item.get_closest_marker("timeout") is None:
            item.add_marker(pytest.mark.timeout(600))


@pytest.fixture(autouse=True)
def _forks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Side, "forks", True)
