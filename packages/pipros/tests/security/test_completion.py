"""TAB and Enter in real shells, with names of peers and files that contain shell syntax."""

from __future__ import annotations

import shutil

import pytest

from pipros.net.master_client import MasterClient
from pipros_workspace.setup_files import SHELL_FOLDER
from tests.support.ros import RosSystem
from tests.support.terminal import EDITING_SHELLS, Terminal
from tests.support.waiting import wait_until

SHELLS = ["bash", "zsh", "fish"]
API = "http://127.0.0.1:9/"
HOSTILE = "$(touch${IFS}pwned)"


def open_shell(ros: RosSystem, program: str) -> Terminal:
    """A shell with the functions and completion of pipros."""
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    terminal = ros.pipros.open_terminal(EDITING_SHELLS[program])
    if program == "zsh":
        terminal.press("autoload -U compinit; compinit -D; cd\n")
    terminal.press(f"source {SHELL_FOLDER}/ros.{program}\n")
    return terminal


@pytest.mark.parametrize("program", SHELLS)
def test_a_name_with_shell_syntax_is_not_completed(ros: RosSystem, program: str) -> None:
    ros.pipros.start_master()
    peer = MasterClient(ros.master_uri, "/zz_evil_node" + HOSTILE)
    peer.register_publisher("/zz_evil" + HOSTILE, "std_msgs/String", API)
    peer.register_service("/zz_evil_service" + HOSTILE, "rosrpc://127.0.0.1:9", API)
    peer.set_param("/zz_evil_param" + HOSTILE, 1)
    MasterClient(ros.master_uri, "/n").register_publisher("/good_topic", "std_msgs/String", API)
    terminal = open_shell(ros, program)
    for line in ("rostopic type /zz", "rosnode info /zz", "rosservice uri /zz", "rosparam get /zz"):
        terminal.press(line + "\t\n")
        terminal.wait_for("(?i)unknown|cannot|not set")

    def completes() -> bool:
        """Completion offers nothing if the master does not answer at once, as on a busy machine."""
        terminal.press("rostopic type /goo\t\n")
        return "std_msgs" in terminal.wait_for(r"std_msgs/String|unknown topic type \[/goo")[0]

    wait_until(completes, 60)
    terminal.wait_for_prompt()
    assert not (ros.home / "pwned").exists()


@pytest.mark.parametrize("program", SHELLS)
def test_names_of_files_are_quoted(ros: RosSystem, program: str) -> None:
    package = ros.home / "src" / "robots"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>robots</name></package>")
    (package / f"evil{HOSTILE};touch pwned").write_text("innocent content\n")
    (package / "two words").write_text("of two words\n")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(package.parent)
    terminal = open_shell(ros, program)
    for started, content in (("ev", "innocent content"), ("tw", "of two words")):
        terminal.press(f"roscat robots {started}\t\n")
        terminal.wait_for(content)
    terminal.wait_for_prompt()
    assert not (ros.home / "pwned").exists()


def test_names_with_line_breaks_are_not_offered(ros: RosSystem) -> None:
    package = ros.home / "src" / "robots"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>robots</name></package>")
    (package / "one\ntwo").write_text("")
    (package / "one").write_text("")
    environment = {"ROS_PACKAGE_PATH": str(package.parent)}
    assert ros.pipros.run("pipros-complete", "2", "roscat", "robots", "o", **environment).stdout == ["one"]
