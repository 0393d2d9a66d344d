"""A workspace created with pipros, then built and tested by genuine catkin and genuine ROS."""

from __future__ import annotations

import pytest

from tests.support.case_study import (
    WORKSPACE,
    create_message,
    make_workspace_and_package,
    write_nodes_test_and_launch_file,
)
from tests.support.ros import RosSystem


@pytest.mark.timeout(600)
def test_genuine_catkin_builds_it_and_genuine_rostest_passes(ros: RosSystem) -> None:
    del ros.pipros.environment["ROS_PACKAGE_PATH"]
    base = ros.home / WORKSPACE
    terminal = ros.pipros.open_terminal()
    make_workspace_and_package(terminal)
    create_message(terminal, base / "src/composiv_tryouts")
    write_nodes_test_and_launch_file(terminal, base / "src/composiv_tryouts")

    underlay = {"CMAKE_PREFIX_PATH": "/usr", "ROS_PACKAGE_PATH": "/usr/share"}
    made = ros.genuine.run("catkin_make", "-C", base, timeout_s=300, **underlay)

    assert made.returncode == 0, made.output
    assert "-- composiv_tryouts: 1 messages, 0 services" in made.stdout
    assert (base / "devel/lib/python3/dist-packages/composiv_tryouts/msg/_BatteryLevel.py").exists()
    tested = ros.genuine.run(
        "bash",
        "-c",
        f". {base}/devel/setup.bash && export ROS_PACKAGE_PATH=$ROS_PACKAGE_PATH:/usr/share && "
        "which rostest && rostest composiv_tryouts composiv_tryout.launch",
        timeout_s=100,
        **underlay,
    )
    assert tested.returncode == 0, tested.output
    assert tested.stdout[0] == "/usr/bin/rostest"
    assert "[composiv_tryouts.rosunit-test_talker/test_talker_publishing][passed]" in tested.stdout
