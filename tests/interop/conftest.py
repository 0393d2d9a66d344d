"""Fixtures for tests with genuine ROS 1 on the other side."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.catkin import CatkinWorkspace, build_once
from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem


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
