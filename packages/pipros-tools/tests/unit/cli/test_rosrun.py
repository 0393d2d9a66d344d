import io
from pathlib import Path

import pytest

from pipros_tools.cli import rosrun


class Became(Exception):
    """Raised in place of `exec`, with which rosrun becomes another program."""

    def __init__(self, command: list[str]) -> None:
        super().__init__(command)
        self.command = command


@pytest.fixture(autouse=True)
def scripts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a package `talkers`, alone on the package path; programs are not executed."""
    folder = tmp_path / "src" / "talkers" / "scripts"
    folder.mkdir(parents=True)
    (folder.parent / "package.xml").write_text("<package><name>talkers</name></package>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))
    monkeypatch.delenv("CMAKE_PREFIX_PATH", raising=False)

    def become(command: list[str], environment: dict[str, str]) -> None:
        raise Became(command)

    monkeypatch.setattr(rosrun, "_replace_process", become)
    return folder


def script(path: Path, mode: int = 0o755) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n")
    path.chmod(mode)
    return path


@pytest.mark.needs("programs that replace a process")
def test_the_program_gets_its_arguments_untouched(scripts: Path) -> None:
    talker = script(scripts / "talker.py")
    with pytest.raises(Became) as became:
        rosrun.main(["talkers", "talker.py", "--debug", "a:=b", "c d"])
    assert became.value.command == [str(talker), "--debug", "a:=b", "c d"]


@pytest.mark.needs("programs that replace a process")
def test_a_launch_prefix_precedes_the_program(scripts: Path) -> None:
    talker = script(scripts / "talker.py")
    with pytest.raises(Became) as became:
        rosrun.main(["--prefix", "nice -n 5", "talkers", "talker.py"])
    assert became.value.command == ["nice", "-n", "5", str(talker)]


@pytest.mark.parametrize("arguments", [[], ["talkers"], ["-h"], ["--help", "a", "b"], ["--prefix"]])
def test_too_few_words_print_the_usage(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert rosrun.main(arguments) == 0
    assert capsys.readouterr().out.startswith("Usage: rosrun [--prefix cmd] [--debug] PACKAGE EXECUTABLE")


def test_an_unknown_package_ends_with_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert rosrun.main(["talker", "x"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.splitlines() == [
        "[rospack] Error: package 'talker' not found",
        "[rosrun] Did you mean talkers?",
    ]


def test_without_a_package_path_an_unknown_package_says_what_to_set(monkeypatch, capsys) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)

    assert rosrun.main(["talker", "x"]) == 2
    assert "[rosrun] ROS_PACKAGE_PATH lists no workspace: " in capsys.readouterr().err


def test_a_missing_folder_in_the_package_path_is_named(tmp_path: Path, monkeypatch, capsys) -> None:
    missing = tmp_path / "moved" / "src"
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(missing))

    assert rosrun.main(["talker", "x"]) == 2
    assert f"[rosrun] ROS_PACKAGE_PATH lists [{missing}], which does not exist" in capsys.readouterr().err


@pytest.mark.needs("executable files")
def test_an_unknown_program_ends_with_3(scripts: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script(scripts / "talker.py")
    assert rosrun.main(["talkers", "talker"]) == 3
    captured = capsys.readouterr()
    assert captured.out == f"[rosrun] Couldn't find executable named talker below {scripts.parent}\n"
    assert captured.err == "[rosrun] Did you mean talker.py?\n"


def test_a_program_that_must_be_compiled_says_so(scripts: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (scripts.parent / "CMakeLists.txt").write_text(
        "project(talkers)\n\n  add_executable( talker talker.cpp)\n"
    )
    assert rosrun.main(["talkers", "talker"]) == 3
    assert f"{scripts.parent / 'CMakeLists.txt'}:3: talker is compiled from C++" in capsys.readouterr().err


@pytest.mark.needs("executable files")
def test_a_script_that_is_not_executable_is_named(scripts: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plain = script(scripts / "talker.py", 0o644)
    assert rosrun.main(["talkers", "talker.py"]) == 3
    assert capsys.readouterr().out.splitlines() == [
        f"[rosrun] Couldn't find executable named talker.py below {scripts.parent}",
        "[rosrun] Found the following, but they're either not files,",
        "[rosrun] or not executable:",
        f"[rosrun]   {plain}",
    ]


@pytest.fixture
def two_talkers(scripts: Path) -> tuple[Path, Path]:
    return script(scripts / "a" / "talker.py"), script(scripts / "b" / "talker.py")


@pytest.mark.needs("programs that replace a process")
def test_the_user_can_choose_among_several_programs(
    two_talkers: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("2\n"))
    with pytest.raises(Became) as became:
        rosrun.main(["talkers", "talker.py"])
    assert became.value.command == [str(two_talkers[1])]
    captured = capsys.readouterr()
    assert "please pick one of the following:" in captured.out
    assert captured.err == f"1) {two_talkers[0]}\n2) {two_talkers[1]}\n#? "


@pytest.mark.parametrize("answer", ["", "9\n", "x\n"])
def test_without_an_answer_nothing_is_run(two_talkers: tuple[Path, Path], answer: str, monkeypatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(answer))
    assert rosrun.main(["talkers", "talker.py"]) == 127


@pytest.mark.needs("programs that replace a process")
def test_debug_prints_the_searched_folders(scripts: Path, capsys: pytest.CaptureFixture[str]) -> None:
    talker = script(scripts / "talker.py")
    with pytest.raises(Became):
        rosrun.main(["--debug", "talkers", "talker.py", "x"])
    lines = capsys.readouterr().out.splitlines()
    assert f"[rosrun] Looking in rospack dir: {scripts.parent}" in lines
    assert lines[-1] == f"[rosrun] Running  {talker} x"


def test_a_prefix_with_an_open_quote_is_refused(scripts: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script(scripts / "talker.py")
    assert rosrun.main(["--prefix", "echo 'x", "talkers", "talker.py"]) == 126
    assert "[echo 'x] is not a valid command" in capsys.readouterr().err


def test_a_typo_in_a_well_known_package_that_is_here_gets_one_hint(scripts: Path, capsys) -> None:
    (scripts.parent / "package.xml").write_text("<package><name>turtlesim</name></package>")
    script(scripts / "turtlesim_node")

    assert rosrun.main(["turtlesim", "turtlesim"]) == rosrun.NOT_FOUND

    assert capsys.readouterr().err == "[rosrun] Did you mean turtlesim_node?\n"
