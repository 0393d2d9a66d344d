"""Every example of the README runs, with the effect described in its comment."""

import re

import pytest

from tests.support import documents
from tests.support.environments import REPOSITORY, VENV_BIN
from tests.support.ros import RosSystem
from tests.support.terminal import Terminal
from tests.tutorial.words import CORE_IS_UP, HEARD, SAID

README = (REPOSITORY / "README.md").read_text()
PYTHON = str(VENV_BIN / "python")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def commands(block: int) -> dict[str, str]:
    """Return the commands of a console example by their first two words."""
    lines = [line.removeprefix("$ ").strip() for line in blocks("console")[block].splitlines()]
    return {" ".join(line.split()[:2]): line for line in lines}


@pytest.mark.timeout(400)
def test_each_command_works_in_its_own_terminal(ros: RosSystem) -> None:
    typed = commands(1)

    def open_terminal() -> Terminal:
        terminal = ros.pipros.open_terminal()
        terminal.run(f"cd {REPOSITORY}")
        terminal.run(next(line for line in typed.values() if line.startswith("export ROS_PACKAGE_PATH")))
        return terminal

    def run(line: str, expected: str) -> Terminal:
        terminal = open_terminal()
        terminal.type(line)
        terminal.wait_for(expected)
        return terminal

    del ros.pipros.environment["ROS_PACKAGE_PATH"]
    run(typed["roscore"], CORE_IS_UP)
    talker = run("rosrun composiv_tryouts composiv_talker.py", SAID)
    listener = run("rosrun composiv_tryouts composiv_listener.py", HEARD)
    run(typed["rostopic echo"], 'battery: "%25"')
    run("rosrun composiv_tryouts test_talker.py", "RESULT: SUCCESS")
    for node in (talker, listener):
        node.press_ctrl_c()
        node.wait_for_prompt()
    run(typed["roslaunch composiv_tryouts"], HEARD)
    run(typed["rostest composiv_tryouts"], "RESULT: SUCCESS")
    assert all(
        f"$ rosrun composiv_tryouts {name}" in README
        for name in ("composiv_talker.py", "composiv_listener.py", "test_talker.py")
    )


def test_the_battery_monitor_warns_is_drawn_and_acknowledged(ros: RosSystem) -> None:
    typed = commands(2)
    ros.pipros.start_master()

    def run(words: str, expected: str) -> None:
        terminal = ros.pipros.open_terminal()
        terminal.type(typed[words])
        terminal.wait_for(expected, 90)

    run("roslaunch vehicle_battery", r"battery low: \d+ %")
    run("rqt_graph", r"http://localhost:\d+/")
    run("rosservice call", "success: True")
    terminal = ros.pipros.open_terminal()
    assert terminal.run(typed["rosrun dynamic_reconfigure"])[0] == 0
    assert ros.pipros.run("rosparam", "get", "/battery_monitor/low").stdout == ["0.4"]
    assert len(typed) == 4


@pytest.mark.parametrize(
    ("example", "topic", "expected"),
    [(0, "/chatter", 'data: "hello"'), (1, "/battery_topic", 'battery: "%25"')],
)
def test_the_nodes_publish(ros: RosSystem, example: int, topic: str, expected: str) -> None:
    ros.pipros.start_master()

    node = ros.pipros.start(PYTHON, "-c", blocks("python")[example])
    echoed = ros.pipros.run("rostopic", "echo", "-n", "1", topic)

    assert echoed.stdout == [expected, "---"], node.output


def test_the_first_screen_has_the_installation_a_node_and_both_pictures() -> None:
    screen = "\n".join(README.splitlines()[:40])

    assert "$ pip install ." in screen
    assert "python3-venv" in screen
    assert blocks("python")[0] in screen
    assert len([line for line in blocks("python")[0].splitlines() if line]) <= 11
    assert "rostopic echo /chatter" in screen
    shown = re.findall(r"\(docs/pictures/(\S+)\)", screen)
    assert shown == ["demo.svg", "scene.png", "battery.png"]
    assert all((REPOSITORY / "docs" / "pictures" / name).is_file() for name in shown)
    assert len(README.split()) < 900


def test_every_task_is_linked() -> None:
    linked = {(REPOSITORY / link).resolve() for link in re.findall(r"\]\(([\w./-]+\.md)\)", README)}
    tasks = {file for name, file in documents.pages().items() if re.fullmatch("how/(?!index).*", name)}
    assert len(tasks) >= 25
    assert tasks - linked == set()


def test_the_set_up_commands_are_those_of_the_scripts() -> None:
    (typed,) = blocks("sh")
    assert typed.splitlines() == ["script/demo", "script/test"]
    assert all((REPOSITORY / command).is_file() for command in typed.splitlines())


def test_the_last_python_example_prints_the_message(ros: RosSystem) -> None:
    ended = ros.pipros.run(PYTHON, "-c", blocks("python")[2])

    assert (ended.returncode, ended.stdout) == (0, ["hello"]), ended.output
