"""What a person has before they type the first command of the case study."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.support.environments import EXAMPLES
from tests.support.ros import RosSystem
from tests.support.terminal import Terminal
from tests.tutorial.words import CORE_IS_UP


@pytest.fixture
def ros(ros: RosSystem) -> RosSystem:
    """The test's own ROS system, in which `roscore` as it is typed takes this system's port.

    By itself it takes 11311, so that two tests could not run side by side.
    """
    ros.pipros.environment["BASH_FUNC_roscore%%"] = f'() {{ command roscore -p {ros.port} "$@"; }}'
    return ros


@pytest.fixture
def own_copy(ros: RosSystem, tmp_path: Path) -> Path:
    """The package in a workspace of the test's own, to change things in it."""
    source = tmp_path / "catkin_ws" / "src"
    shutil.copytree(EXAMPLES / "composiv_tryouts", source / "composiv_tryouts")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(source)
    return source / "composiv_tryouts"


@pytest.fixture
def core(ros: RosSystem) -> Terminal:
    """A terminal in which roscore runs."""
    terminal = ros.pipros.open_terminal()
    terminal.type("roscore")
    terminal.wait_for(CORE_IS_UP)
    return terminal
