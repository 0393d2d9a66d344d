"""Fixtures: the environment of a user before the first command of the case study."""

import shutil
from pathlib import Path

import pytest

from tests.support.environments import EXAMPLES
from tests.support.ros import RosSystem
from tests.support.terminal import Terminal
from tests.tutorial.words import CORE_IS_UP


@pytest.fixture
def ros(ros: RosSystem) -> RosSystem:
    """A private ROS system; `roscore` in its terminals uses its port.

    By itself it takes 11311, so that two tests could not run side by side.
    """
    ros.pipros.environment["BASH_FUNC_roscore%%"] = f'() {{ command roscore -p {ros.port} "$@"; }}'
    return ros


@pytest.fixture
def own_copy(ros: RosSystem, tmp_path: Path) -> Path:
    """A private workspace with a copy of the package, which a test may change."""
    source = tmp_path / "catkin_ws" / "src"
    shutil.copytree(EXAMPLES / "composiv_tryouts", source / "composiv_tryouts")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(source)
    return source / "composiv_tryouts"


@pytest.fixture
def core(ros: RosSystem) -> Terminal:
    """A terminal in which roscore runs, and a master that knows /rosout."""
    terminal = ros.pipros.open_terminal()
    terminal.type("roscore")
    terminal.wait_for(CORE_IS_UP)
    ros.wait_for_publisher("/rosout_agg")
    return terminal
