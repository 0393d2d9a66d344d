import sys
from pathlib import Path

import pytest

from pipros.basics.graph_variables import InvalidEnvironment
from pipros_workspace.program_description import describe_program
from pipros_workspace.program_start import command_of, why_not_startable
from pipros_workspace.script_interpreter import interpreter_of
from tests.support.interpreters import add_rospy, make_interpreter

pytestmark = pytest.mark.needs("first lines")


def script(folder: Path, first_line: str, mode: int = 0o755) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "talker.py"
    path.write_text(f"{first_line}\nimport rospy\n")
    path.chmod(mode)
    return path


def test_an_interpreter_without_rospy_is_replaced(tmp_path: Path) -> None:
    other = make_interpreter(tmp_path / "usr")
    talker = script(tmp_path / "ws", f"#!{other}")
    assert command_of(talker, ["a"], variables={}) == [sys.executable, str(talker), "a"]
    assert why_not_startable(talker, {}) is None


@pytest.mark.parametrize("first_line", ["#!{} -u", "#! {}\t -u "])
def test_an_option_in_the_first_line_is_kept(tmp_path: Path, first_line: str) -> None:
    talker = script(tmp_path / "ws", first_line.format(make_interpreter(tmp_path / "usr")))
    assert command_of(talker, variables={}) == [sys.executable, "-u", str(talker)]


@pytest.mark.parametrize("rospy_in", [
    "lib/python3/dist-packages", "lib/python3.11/site-packages", "lib/python3.11/dist-packages",
    "lib64/python3.11/site-packages", "local/lib/python3.11/dist-packages",
])  # fmt: skip
def test_an_interpreter_with_rospy_is_used(tmp_path: Path, rospy_in: str) -> None:
    other = make_interpreter(tmp_path / "usr", rospy_in=rospy_in)
    talker = script(tmp_path / "ws", f"#!{other}")
    assert command_of(talker, variables={}) == [str(talker)]


def test_the_rospy_of_another_version_does_not_count(tmp_path: Path) -> None:
    other = make_interpreter(tmp_path / "usr", rospy_in="lib/python3.8/site-packages")
    assert command_of(script(tmp_path / "ws", f"#!{other}"), variables={})[0] == sys.executable


def test_rospy_on_the_python_path_counts(tmp_path: Path) -> None:
    other = make_interpreter(tmp_path / "usr")
    talker = script(tmp_path / "ws", f"#!{other}")
    add_rospy(tmp_path / "opt")
    assert command_of(talker, variables={"PYTHONPATH": f"/nowhere:{tmp_path / 'opt'}"}) == [str(talker)]


def test_the_own_rospy_on_the_python_path_does_not_count(tmp_path: Path) -> None:
    import rospy

    other = make_interpreter(tmp_path / "usr")
    talker = script(tmp_path / "ws", f"#!{other}")
    own = str(Path(rospy.__file__).parents[1])
    assert command_of(talker, variables={"PYTHONPATH": own})[0] == sys.executable


def test_rospy_in_the_home_of_the_user_counts(tmp_path: Path) -> None:
    other = make_interpreter(tmp_path / "usr")
    talker = script(tmp_path / "ws", f"#!{other}")
    add_rospy(tmp_path / "home" / ".local" / "lib" / "python3.11" / "site-packages")
    assert command_of(talker, variables={"HOME": str(tmp_path / "home")}) == [str(talker)]


def test_rospy_of_a_path_file_counts(tmp_path: Path) -> None:
    other = make_interpreter(tmp_path / "usr")
    add_rospy(tmp_path / "checkout")
    site = tmp_path / "usr" / "lib" / "python3.11" / "site-packages"
    (site / "x.pth").write_text(f"# a comment\nimport sys\n\n{tmp_path / 'checkout'}\n")
    talker = script(tmp_path / "ws", f"#!{other}")
    assert command_of(talker, variables={}) == [str(talker)]


@pytest.mark.parametrize(("with_system", "uses_it"), [("true", True), ("false", False)])
def test_a_virtual_environment_sees_the_rospy_of_the_system_if_it_says_so(
    tmp_path: Path, with_system: str, uses_it: bool
) -> None:
    system = make_interpreter(tmp_path / "usr", rospy_in="lib/python3/dist-packages")
    other = tmp_path / "venv" / "bin" / "python"
    other.parent.mkdir(parents=True)
    other.symlink_to(system)
    (tmp_path / "venv" / "pyvenv.cfg").write_text(f"include-system-site-packages = {with_system}\n")
    talker = script(tmp_path / "ws", f"#!{other}")
    assert (command_of(talker, variables={}) == [str(talker)]) is uses_it


@pytest.mark.parametrize("name", ["python", "python3", "python3.6"])
def test_an_absent_interpreter_is_replaced(tmp_path: Path, name: str) -> None:
    talker = script(tmp_path / "ws", f"#!{tmp_path}/usr/bin/{name}")
    assert command_of(talker, variables={}) == [sys.executable, str(talker)]
    assert why_not_startable(talker, {}) is None


def test_a_program_installed_with_the_interpreter_stays_with_it(tmp_path: Path) -> None:
    other = make_interpreter(tmp_path / "usr")
    talker = script(tmp_path / "usr" / "lib" / "chatter", f"#!{other}")
    assert command_of(talker, variables={}) == [str(talker)]


def test_the_variable_overrides_either_choice(tmp_path: Path) -> None:
    without = script(tmp_path / "a", f"#!{make_interpreter(tmp_path / 'usr')}")
    genuine = make_interpreter(tmp_path / "ros", rospy_in="lib/python3/dist-packages")
    with_rospy = script(tmp_path / "b", f"#!{genuine}")
    own, by_script = {"PIPROS_INTERPRETER": "own"}, {"PIPROS_INTERPRETER": "script"}
    assert command_of(with_rospy, variables=own) == [sys.executable, str(with_rospy)]
    assert command_of(without, variables=by_script) == [str(without)]
    absent = script(tmp_path / "c", "#!/opt/none/python3")
    assert "/opt/none/python3, which does not exist" in (why_not_startable(absent, by_script) or "")


def test_an_unknown_choice_is_an_error(tmp_path: Path) -> None:
    talker = script(tmp_path / "ws", "#!/opt/none/python3")
    with pytest.raises(InvalidEnvironment, match=r"must be own or script, got \[both\]"):
        command_of(talker, variables={"PIPROS_INTERPRETER": "both"})


@pytest.mark.parametrize(
    "first_line", ["#!/opt/none/python2", "#!/opt/none/python2.7", "#!/usr/bin/env python2"]
)
def test_a_python_2_script_is_explained_in_one_line(tmp_path: Path, first_line: str) -> None:
    problem = why_not_startable(script(tmp_path / "ws", first_line), {"PATH": "/nowhere"}) or ""
    assert f"is a Python 2 script ({first_line}), and ROS Noetic runs Python 3; convert it" in problem
    assert "\n" not in problem


def test_a_python_2_with_rospy_runs_its_scripts(tmp_path: Path) -> None:
    other = make_interpreter(tmp_path / "usr", rospy_in="lib/python2.7/dist-packages", version="2.7")
    talker = script(tmp_path / "ws", f"#!{other}")
    assert command_of(talker, variables={}) == [str(talker)]
    assert why_not_startable(talker, {}) is None


@pytest.mark.parametrize(
    "first_line", ["#!/bin/sh", "#!/opt/none/python3\r", "#!/opt/none/pythonista", "#!/usr/bin/env", "#!"]
)
def test_other_first_lines_are_left_to_the_operating_system(tmp_path: Path, first_line: str) -> None:
    talker = script(tmp_path / "ws", first_line)
    assert interpreter_of(talker, {}) is None
    assert command_of(talker, variables={}) == [str(talker)]


def test_env_finds_its_python_in_the_path(tmp_path: Path) -> None:
    other = make_interpreter(tmp_path / "usr")
    talker = script(tmp_path / "ws", "#!/usr/bin/env python3")
    chosen = interpreter_of(talker, {"PATH": str(other.parent)})
    assert chosen is not None
    assert (chosen.words, chosen.interpreter) == ((), str(other))


def test_a_script_that_is_not_executable_is_left_alone(tmp_path: Path) -> None:
    talker = script(tmp_path / "ws", "#!/opt/none/python3", 0o644)
    assert command_of(talker, variables={}) == [str(talker)]


def test_descriptions_name_the_interpreter_and_the_reason(tmp_path: Path) -> None:
    other = make_interpreter(tmp_path / "usr")
    talker = script(tmp_path / "ws", f"#!{other}")
    found = describe_program(talker, {})
    reason = f"because {other}, which its first line names, has no rospy"
    assert str(found) == f"{talker} is started with {sys.executable}, {reason}"
    assert found.is_startable
    talker.chmod(0o644)
    assert str(describe_program(talker, {})).endswith(f"do not find it; run: chmod +x {talker}")
    shell = tmp_path / "start"
    shell.write_text("echo hello\n")
    shell.chmod(0o755)
    assert (
        str(describe_program(shell, {}))
        == f"{shell} is started with /bin/sh, because it names no interpreter"
    )
    assert str(describe_program(tmp_path, {})) == f"{tmp_path} is not a file"
