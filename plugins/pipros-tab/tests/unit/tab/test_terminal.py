"""Completion in the terminals of a tab, and the commands of docs/start/tab.md."""

import re
from pathlib import Path

import pytest

from pipros_tab.terminal import completed, completions, edit_in_package
from tests.support.environments import REPOSITORY


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    return tmp_path


def test_commands_files_and_programs_of_packages_are_completed(home: Path) -> None:
    (home / "feature").mkdir()
    (home / "feature/talker.py").touch()
    (home / ".hidden").touch()
    assert (completions("rosno"), completions("cd feature; chm")) == (["rosnode"], ["chmod"])
    assert (completions("cd "), completions("cat feature/t")) == (["feature/"], ["feature/talker.py"])
    assert completions("cat .h") == [".hidden"]
    assert completions("rosrun rospy_tutorials talker_h") == ["talker_header.py"]
    assert completions("cat nowhere/t") == []
    assert completions("rostopic pub /chatter std_msgs/String ") == ["\"{data: ''}\""]
    zero = "{x: 0.0, y: 0.0, z: 0.0}"
    twist = completions("rostopic pub -1 /turtle1/cmd_vel geometry_msgs/Twist ")
    assert twist == [f'"{{linear: {zero}, angular: {zero}}}"']


def test_a_line_is_completed_as_far_as_all_words_agree() -> None:
    assert completed("rosno", ["rosnode"]) == "rosnode "
    assert completed("cd feat", ["feature/"]) == "cd feature/"
    assert completed("roslaunch a b sp", ["speed:=", "speedy"]) == "roslaunch a b speed"
    assert completed("rosparam set x", []) == "rosparam set x"


def test_rosed_opens_a_file_of_a_package(capsys: pytest.CaptureFixture[str]) -> None:
    assert edit_in_package(["rospy_tutorials", "AddTwoInts.srv"]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("\033]133;E;/")
    assert shown.endswith("/rospy_tutorials/srv/AddTwoInts.srv\007")
    assert edit_in_package(["rospy_tutorials", "nothing"]) == 1


def test_the_case_study_of_the_docs_is_typed_in_pyodide() -> None:
    shown = (REPOSITORY / "plugins/pipros-tab/docs/start/tab.md").read_text(encoding="utf-8")
    typed = (REPOSITORY / "plugins/pipros-tab/tests/pyodide/test_terminal.py").read_text(encoding="utf-8")
    lines = re.findall(r"^\$ (.+)$", shown, re.MULTILINE)
    assert len(lines) > 20
    names = {"~/feature/buse_nur_emir_07042023/catkin_ws": "~/{WORKSPACE}"}
    for before, after in names.items():
        lines = [line.replace(before, after) for line in lines]
    assert [line for line in lines if line not in typed] == []
