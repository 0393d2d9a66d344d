"""Run the whole document in a shell, from an empty folder, without CMake, a compiler or genuine ROS."""

import pytest

from tests.support.case_study import (
    SOURCE,
    WORKSPACE,
    create_message,
    make_workspace_and_package,
    write_nodes_test_and_launch_file,
)
from tests.support.lacks import system
from tests.support.ros import RosSystem
from tests.support.terminal import Terminal
from tests.tutorial.words import CORE_IS_UP, HEARD, LAUNCH, LISTENER, ROSTEST, SAID, TALKER, TEST


@pytest.fixture
def ros(ros: RosSystem) -> RosSystem:
    """A ROS system with only pipros installed, in which no package is known yet."""
    del ros.pipros.environment["ROS_PACKAGE_PATH"]
    return ros


def open_sourced_terminal(ros: RosSystem) -> Terminal:
    """Open another terminal, whose ~/.bashrc contains the line added in section 4.1."""
    terminal = ros.pipros.open_terminal()
    assert terminal.run(SOURCE)[0] == 0
    return terminal


@pytest.mark.timeout(400)
def test_every_step_of_the_document_works_as_it_is_typed(ros: RosSystem) -> None:
    package = ros.home / WORKSPACE / "src/composiv_tryouts"
    first = ros.pipros.open_terminal()
    for tool in ("cmake", "make", "cc", "gcc", "g++"):
        assert first.run(f"command {tool}")[0] != 0, f"{tool} is there"

    make_workspace_and_package(first)
    create_message(first, package)
    assert first.run("rosmsg show composiv_tryouts/BatteryLevel") == (0, "string battery\n\n")

    write_nodes_test_and_launch_file(first, package)
    if system() != "windows":  # where all files are executable
        script = package / "scripts/composiv_talker.py"
        script.chmod(0o644)
        assert first.run(TALKER) == (
            3,
            f"[rosrun] Couldn't find executable named composiv_talker.py below {package}\n"
            "[rosrun] Found the following, but they're either not files,\n"
            "[rosrun] or not executable:\n"
            f"[rosrun]   {script}\n",
        )
        script.chmod(0o755)
    first.type("roscore")
    first.wait_for(CORE_IS_UP)
    talker, listener, test = (open_sourced_terminal(ros) for _ in range(3))
    talker.type(TALKER)
    talker.wait_for(SAID)
    listener.type(LISTENER)
    listener.wait_for(HEARD)
    code, output = test.run(TEST)
    assert code == 0
    assert "\x1b[32m * RESULT: SUCCESS\x1b[0m\n * TESTS: 1\n" in output
    for terminal in (talker, listener, first):
        terminal.press_ctrl_c()
        assert terminal.wait_for_prompt() == 0

    first.type(f"{LAUNCH} --screen")
    first.wait_for(HEARD)
    first.press_ctrl_c()
    assert first.wait_for_prompt() == 0
    code, output = first.run(ROSTEST)
    assert code == 0
    assert "[composiv_tryouts.rosunit-test_talker/test_talker_publishing][passed]\n" in output
