"""Fixtures for tests with genuine ROS 1 on the other side."""

from __future__ import annotations

import pytest

from tests.support.catkin import CatkinWorkspace, build_once
from tests.support.ros import RosSystem


@pytest.fixture(scope="session")
def catkin_workspace() -> CatkinWorkspace:
    """The example and the C++ nodes, built by genuine catkin."""
    return build_once()


@pytest.fixture
def ros(ros: RosSystem, catkin_workspace: CatkinWorkspace) -> RosSystem:
    """The ROS system of the test, with the workspace sourced on the genuine side."""
    ros.genuine.environment.update(catkin_workspace.variables)
    return ros
