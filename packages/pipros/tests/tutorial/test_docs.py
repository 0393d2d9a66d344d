"""Run every command and Python block of docs/: most pages in this file, the others in those of OTHERS.

A `console` block is a terminal. The lines after a command must appear in its output in that order; `...`
matches any text, or any lines if it is a whole line. A last command that does not exit runs until the end of
the page. A block with a title is a file.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.support.environments import MERGED, REPOSITORY
from tests.support.ros import RosSystem
from tests.support.terminal import Terminal
from tests.support.waiting import wait_until

DOCS = REPOSITORY / "docs"
BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.MULTILINE | re.DOTALL)
PAGES = ("start.md", "package.md", "robot.md", "course.md", "simulation.md")

# By page and language: the test that runs these blocks.
OTHERS = {
    ("api.md", "python"): "packages/pipros/tests/tutorial/test_client_docs.py",
    ("assistants.md", "console"): "packages/pipros-assistants/tests/graph/test_assistant_example.py",
    ("assistants.md", "json"): "packages/pipros-assistants/tests/unit/assistants/test_docs.py",
    ("assistants.md", "yaml"): "packages/pipros-assistants/tests/graph/test_assistant_example.py",
    ("bags.md", "python"): "packages/pipros/tests/unit/bag/test_docs.py",
    ("browser.md", "python"): "packages/pipros/tests/tree/test_other_systems.py",
    ("bridges.md", "console"): "packages/pipros-bridges/tests/graph/test_serve.py",
    ("ci.md", "ini"): "packages/pipros/tests/tutorial/test_ci_docs.py",
    ("ci.md", "yaml"): "packages/pipros/tests/tutorial/test_ci_docs.py",
    ("client.md", "python"): "packages/pipros/tests/tutorial/test_client_docs.py",
    ("data.md", "console"): "packages/pipros-data/tests/unit/data/test_docs.py",
    ("data.md", "python"): "packages/pipros-data/tests/unit/data/test_docs.py",
    ("data.md", "yaml"): "packages/pipros-data/tests/unit/data/test_docs.py",
    ("fleets.md", "console"): "packages/pipros-fleet/tests/graph/test_fleet_command.py",
    ("fleets.md", "yaml"): "packages/pipros-fleet/tests/unit/fleet/test_docs.py",
    ("launch.md", "python"): "packages/pipros/tests/graph/test_launch_facade.py",
    ("launch.md", "sh"): "packages/pipros/tests/graph/test_launch_child.py",
    ("launch.md", "xml"): "packages/pipros/tests/interop/test_remote_machines.py",
    ("libraries.md", "python"): "packages/pipros/tests/graph/test_zero_copy.py",
    ("navigation.md", "console"): "packages/pipros-robot/tests/graph/test_turtlebot3_launch.py",
    ("navigation.md", "python"): "packages/pipros-robot/tests/graph/test_navigation_world.py",
    ("navigation.md", "toml"): "packages/pipros-robot/tests/unit/navigation/costmap/test_own_layers.py",
    ("messages.md", "python"): "packages/pipros/tests/unit/msg/test_docs.py",
    ("page.md", "console"): "packages/pipros-page/tests/graph/test_rqt_graph.py",
    ("page.md", "xml"): "packages/pipros-page/tests/graph/test_page_tabs.py",
    ("pip.md", "bash"): "packages/pipros-wheels/tests/tutorial/test_pip.py",
    ("pip.md", "python"): "packages/pipros-wheels/tests/tutorial/test_pip.py",
    ("pip.md", "toml"): "packages/pipros-wheels/tests/tutorial/test_pip.py",
    ("policy.md", "console"): "packages/pipros/tests/unit/cli/test_policy.py",
    ("policy.md", "yaml"): "packages/pipros/tests/unit/cli/test_policy.py",
    ("ros2.md", "bash"): "packages/pipros-ros2/tests/interop/test_walk.py",
    ("ros2.md", "console"): "packages/pipros-ros2/tests/graph/test_ros2_command.py",
    ("ros2.md", "python"): "packages/pipros-ros2/tests/interop/test_one_environment.py",
    ("ros2.md", "xml"): "packages/pipros-ros2/tests/interop/test_walk.py",
    ("ros2.md", "yaml"): "packages/pipros-ros2/tests/unit/ros2/test_docs.py",
    ("rtps.md", "python"): "packages/pipros-ros2/tests/unit/ros2/rtps/test_participant.py",
    ("scene.md", "console"): "packages/pipros-page/tests/graph/test_rviz.py",
    ("tab.md", "console"): "packages/pipros-tab/tests/pyodide/test_terminal.py",
    ("testing.md", "console"): "packages/pipros/tests/graph/test_pytest_plugin.py",
    ("testing.md", "python"): "packages/pipros/tests/graph/test_pytest_plugin.py",
    ("testing.md", "xml"): "packages/pipros/tests/graph/test_pytest_plugin.py",
}
# By page and language: why no test runs these blocks as they are.
NOT_RUN = {
    ("start.md", "sh"): "installation, which test_installed_wheel.py and script/fresh do",
    ("start.md", "powershell"): "installation on Windows, as script/demo.cmd does it",
    ("start.md", "bat"): "installation on Windows, as script/demo.cmd does it",
    ("classroom.md", "sh"): "installation on the computers of a class, as in script/fresh course",
    ("containers.md", "sh"): "needs containers and routers; tests.interop.test_nat has the same settings",
    ("containers.md", "yaml"): "needs Docker or Kubernetes, which were not run",
    ("messages.md", "sh"): "tests/interop/test_shipped_packages_in_cpp.py builds such a workspace",
    ("pip.md", "sh"): "the reader's folders; tests/tutorial/test_pip.py runs the same commands",
    ("simulation.md", "sh"): "an argument that tests.graph.test_turtlebot3_launch sets, too",
    ("tools.md", "sh"): "a table that is not included; tests.unit.cli.test_launch_survey has a small one",
    ("robot.md", "sh"): "needs several computers; tests.interop.test_addresses has the same settings",
    ("bags.md", "sh"): "options of rosbag, which tests.unit.cli.test_rosbag runs one by one",
    ("bridges.md", "javascript"): "clients from npm, which tests/clients runs with other programs",
    ("bridges.md", "python"): "clients from PyPI, which tests/clients runs with other programs",
    ("bridges.md", "xml"): "a part of a launch file",
    ("libraries.md", "toml"): "a package like that of tests.graph.test_nodelets",
    ("libraries.md", "yaml"): "parameters like those of tests.graph.test_lasers",
    ("libraries.md", "xml"): "a launch file like that of tests.graph.test_teleoperation",
    ("assistants.md", "sh"): "installation of an extra",
    ("data.md", "sh"): "installation of an extra",
    ("ros2.md", "sh"): "installation from PyPI, as tests/support/ros2_wheels.py does it",
    ("navigation.md", "sh"): "installation of an extra",
    ("navigation.md", "yaml"): "parameters, as tests.support.both_costmaps sets them",
    (
        "navigation.md",
        "xml",
    ): "parameters, which tests.graph.test_robot_localization sets in a launch file",
}
OUTPUT = {"text"}


@pytest.mark.timeout(400)
@pytest.mark.parametrize("page", PAGES)
def test_the_commands_of_a_page_print_the_output_shown(ros: RosSystem, page: str) -> None:
    text = (DOCS / page).read_text()
    for language, title, content in BLOCK.findall(text):
        if title:
            path = ros.home / title.removeprefix("~/")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content)
        elif language == "console":
            _type(ros, content)


def _type(ros: RosSystem, block: str) -> None:
    terminal = ros.pipros.open_terminal()
    commands = [part.partition("\n") for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]]
    for line, _, expected in commands:
        terminal.type(line)
        _wait_for(terminal, expected)
        if line == "roscore":
            ros.wait_for_publisher("/rosout_agg")
        elif line.startswith("rostopic pub") and not expected:
            ros.wait_for_publisher(line.split()[2])
        if line != commands[-1][0]:
            assert terminal.wait_for_prompt() == 0, terminal.text


def _wait_for(terminal: Terminal, expected: str) -> None:
    pattern = re.compile(_pattern(expected))
    wait_until(
        lambda: pattern.search(terminal.text), 60, lambda: f"{expected}in the output:\n{terminal.text}"
    )


def _pattern(expected: str) -> str:
    """A regular expression for the expected lines."""
    lines = [
        "(?:.*\n)*?" if line == "..." else re.escape(line).replace(r"\.\.\.", ".*") + r".*\n"
        for line in expected.splitlines()
    ]
    return "".join(lines)


def test_commands_have_no_comments_which_zsh_would_pass_on() -> None:
    commented = [
        f"{page.name}: {line}"
        for page in (REPOSITORY / "README.md", *sorted(DOCS.glob("*.md")))
        for language, _, content in BLOCK.findall(page.read_text())
        for line in content.splitlines()
        if (language == "sh" or (language == "console" and line.startswith("$ ")))
        and re.search(r"(^|\s)#(\s|$)", line)
    ]
    assert commented == []


def test_every_block_of_every_page_is_run_by_a_test() -> None:
    missing = []
    for page in sorted(DOCS.glob("*.md")):
        for language, _, _ in BLOCK.findall(page.read_text()):
            place = (page.name, language)
            if page.name in PAGES and language in ("console", "python", "xml", "cmake"):
                continue
            if place not in OTHERS and place not in NOT_RUN and language not in OUTPUT:
                missing.append(place)
    assert not missing


def test_no_block_is_hidden_from_these_tests() -> None:
    """Blocks without a language, and indented ones, would be neither run nor listed."""
    hidden = []
    for page in sorted(DOCS.glob("*.md")):
        is_block = False
        for number, line in enumerate(page.read_text().splitlines(), 1):
            if line.lstrip().startswith("```"):
                is_block = not is_block
                if is_block and not re.match(r"```\w", line):
                    hidden.append(f"{page.name}:{number}: {line}")
            elif not is_block and re.match(r" {4}(?!options:| {2}heading_level:)\S", line):
                hidden.append(f"{page.name}:{number}: {line}")
    assert hidden == []


@pytest.mark.parametrize(("place", "test"), OTHERS.items(), ids=str)
def test_the_test_named_for_a_block_exists(place: tuple[str, str], test: str) -> None:
    page, language = place
    assert Path(REPOSITORY, test).is_file()
    assert f"```{language}" in (DOCS / page).read_text()


@pytest.mark.parametrize("place", NOT_RUN, ids=str)
def test_the_reason_not_to_run_a_block_is_needed(place: tuple[str, str]) -> None:
    page, language = place
    assert f"```{language}" in (DOCS / page).read_text()
    named = re.findall(r"tests/[\w/]+(?:\.py)?", NOT_RUN[place])
    assert all(Path(MERGED, test).exists() for test in named)
