"""Fixtures for tests with genuine ROS 1 on the other side."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.catkin import CatkinWorkspace, build_once
from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Give each test that may be the first to need the workspace the time to build it."""
    for item in items:
        names = getattr(item, "fixturenames", ())
        if "catkin_workspace" in names and item.get_closest_marker("timeout") is None:
            item.add_marker(pytest.mark.timeout(600))


@pytest.fixture(scope="session")
def catkin_workspace() -> CatkinWorkspace:
    """The example and the C++ nodes, built by genuine catkin."""
    return build_once()


@pytest.fixture
def plain_ros(claimed_port: ClaimedPort, tmp_path: Path, bare_tools: Path) -> Iterator[RosSystem]:
    """A ROS system as in other tests, for tests that do not need the workspace and its slow build."""
    system = RosSystem(claimed_port.number, tmp_path, bare_tools)
    yield system
    system.close()


@pytest.fixture
def ros(ros: RosSystem, catkin_workspace: CatkinWorkspace) -> RosSystem:
    """The ROS system of the test, with the workspace sourced on the genuine side."""
    ros.genuine.environment.update(catkin_workspace.variables)
    return ros
