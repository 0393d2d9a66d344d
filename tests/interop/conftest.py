"""Fixtures for tests with genuine ROS 1 on the other side."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.catkin import CatkinWorkspace, build_once
from tests.support.ros import RosSystem


@pytest.fixture(scope="session")
def catkin_workspace(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> CatkinWorkspace:
    """The example and the C++ nodes, built by genuine catkin."""
    base: Path = tmp_path_factory.getbasetemp()
    return build_once(base if worker_id == "master" else base.parent)


@pytest.fixture
def ros(ros: RosSystem, catkin_workspace: CatkinWorkspace) -> RosSystem:
    """The ROS system of the test, with the workspace sourced on the genuine side."""
    ros.genuine.environment.update(catkin_workspace.variables)
    return ros
