from __future__ import annotations

import errno
import json
import os
from pathlib import Path

import pytest

from pipros_tools.cli import catkin_init_workspace, catkin_make, catkin_test_results
from tests.support.full_disk import files_limited_to

MANIFEST = (
    '<package format="2"><name>{name}</name><version>0.1.0</version><description>d</description>'
    '<maintainer email="a@example.org">A</maintainer><license>Apache-2.0</license></package>'
)


@pytest.fixture
def base(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A workspace of two packages, and a machine without CMake."""
    for name in ("one", "two"):
        folder = tmp_path / "src" / name
        folder.mkdir(parents=True)
        (folder / "package.xml").write_text(MANIFEST.format(name=name))
        (folder / "CMakeLists.txt").write_text(f"project({name})\ncatkin_package()\n")
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_spaces_are_announced_as_in_noetic(base: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert catkin_make.main([]) == 0
    assert capsys.readouterr().out.splitlines()[:5] == [
        f"Base path: {base}", f"Source space: {base}/src", f"Build space: {base}/build",
        f"Devel space: {base}/devel", f"Install space: {base}/install",
    ]  # fmt: skip
    assert (base / ".catkin_workspace").is_file()
    assert (base / "devel" / "setup.bash").is_file()


@pytest.mark.parametrize(("arguments", "built"), [
    (["--pkg", "one"], ["one"]), (["--only-pkg-with-deps", "two"], ["two"]),
    (["-DCATKIN_WHITELIST_PACKAGES=one"], ["one"]), (["-DCATKIN_BLACKLIST_PACKAGES=one"], ["two"]),
    (
        ["-DCATKIN_WHITELIST_PACKAGES=", "-j4", "-l2", "--cmake-args", "-DCMAKE_BUILD_TYPE=Release"],
        ["one", "two"],
    ),
    (["-j", "4", "--jobs=2", "-k", "VERBOSE=1", "-l", "2.5", "--make-args", "-s", "all"], ["one", "two"]),
    (["--pkg", "one", "nope"], ["one"]),
])  # fmt: skip
def test_packages_are_chosen(
    base: Path, arguments: list[str], built: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert catkin_make.main(arguments) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split("'")[1] for line in lines if "+++ processing" in line] == built


def test_the_devel_space_can_be_elsewhere(base: Path) -> None:
    assert catkin_make.main(["-DCATKIN_DEVEL_PREFIX=other", "--source", "src"]) == 0
    assert (base / "other" / "setup.sh").is_file()
    assert not (base / "devel").exists()


def test_clean_makes_the_next_build_a_full_one(base: Path, capsys: pytest.CaptureFixture[str]) -> None:
    catkin_make.main([])
    capsys.readouterr()
    catkin_make.main([])
    assert "Nothing has changed: 2 packages are up to date" in capsys.readouterr().out
    assert catkin_make.main(["clean"]) == 0
    capsys.readouterr()
    catkin_make.main([])
    assert "Nothing has changed" not in capsys.readouterr().out


@pytest.mark.parametrize(("arguments", "message"), [
    (["--pkg", "nope"], 'Packages "nope" not found in the workspace'),
    (["--only-pkg-with-deps", "b", "a"], 'Packages "a, b" not found in the workspace'),
    (["-C", "nowhere"], '/nowhere" does not exist'), (["-C", "src"], 'The specified source space "'),
    (["-C", "src/one"], 'contains a package but "catkin_make" must be invoked in the root of workspace'),
    (["-DCATKIN_ENABLE_TESTING=0", "run_tests"], "No rule to make target 'run_tests'"),
])  # fmt: skip
def test_invalid_targets_and_options_exit_with_1(
    base: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert catkin_make.main(arguments) == 1
    assert message in capsys.readouterr().err


@pytest.mark.needs("first lines")
def test_a_custom_target_is_made_when_it_is_named(base: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = base / "src" / "one" / "CMakeLists.txt"
    file.write_text(file.read_text() + "add_custom_target(mine COMMAND ${CMAKE_COMMAND} -E touch made)\n")
    assert catkin_make.main([]) == 0
    assert not (base / "build" / "one" / "made").exists()
    assert catkin_make.main(["mine"]) == 0
    assert (base / "build" / "one" / "made").exists()


def test_an_unknown_target_is_named(base: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert catkin_make.main(["nonsense"]) == 1
    assert "make: *** No rule to make target 'nonsense'.  Stop." in capsys.readouterr().err


def test_results_are_removed_by_their_targets(base: Path) -> None:
    result_file(base, "one/a.xml")
    result_file(base, "two/a.xml")
    assert catkin_make.main(["clean_test_results_one"]) == 0
    assert [path.parent.name for path in base.rglob("a.xml")] == ["two"]
    assert catkin_make.main(["clean_test_results"]) == 0
    assert not list(base.rglob("a.xml"))


def test_an_unknown_option_ends_with_2(base: Path) -> None:
    with pytest.raises(SystemExit) as end:
        catkin_make.main(["--nonsense"])
    assert end.value.code == 2


def test_a_source_folder_is_initialised_once(base: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert catkin_init_workspace.main([str(base / "src")]) == 0
    assert (base / "src" / "CMakeLists.txt").exists()
    assert catkin_init_workspace.main([str(base / "src")]) == 2
    assert "already exists" in capsys.readouterr().err


def result_file(folder: Path, name: str, **counts: int) -> None:
    attributes = "".join(f' {key}="{value}"' for key, value in counts.items())
    file = folder / "build" / "test_results" / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"<testsuite{attributes}/>")


def test_results_are_summed_up(base: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result_file(base, "one/good.xml", tests=3, errors=0, failures=0)
    assert catkin_test_results.main([]) == 0
    assert capsys.readouterr().out == "Summary: 3 tests, 0 errors, 0 failures, 0 skipped\n"
    result_file(base, "one/bad.xml", tests=2, errors=1, failures=1, skip=1)
    (base / "build/test_results/none.xml").write_text("<other/>")
    assert catkin_test_results.main(["build/test_results"]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "one/bad.xml: 2 tests, 1 errors, 1 failures, 1 skipped",
        "Summary: 5 tests, 1 errors, 1 failures, 1 skipped",
    ]
    assert catkin_test_results.main(["--all", "--verbose", "build"]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "Skipping \"test_results/none.xml\": the root tag is neither 'testsuite' nor 'testsuites'",
        "Full test results for 'test_results/one/bad.xml'",
        "-" * 49,
        '<testsuite tests="2" errors="1" failures="1" skip="1"/>',
        "-" * 49,
        "test_results/one/bad.xml: 2 tests, 1 errors, 1 failures, 1 skipped",
        "test_results/one/good.xml: 3 tests",
        "Summary: 5 tests, 1 errors, 1 failures, 1 skipped",
    ]
    assert catkin_test_results.main(["/nowhere"]) == 1
    assert capsys.readouterr().err == 'Test results directory "/nowhere" does not exist\n'


def test_the_summary_of_a_failure_has_place_and_reason(
    base: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = base / "src/one/CMakeLists.txt"
    file.write_text('project(one)\nmessage(FATAL_ERROR "No such robot")\ncatkin_package()\n')
    assert catkin_make.main([]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert [line for line in lines if " * " in line] == [
        f"\x1b[31m * one: CMake Error at {file}:2 (message): No such robot\x1b[0m"
    ]


def test_the_summary_of_a_traceback_has_its_last_line(base: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = base / "src/one"
    (folder / "CMakeLists.txt").write_text("project(one)\ncatkin_python_setup()\ncatkin_package()\n")
    (folder / "setup.py").write_text("from distutils.core import setup\nimport no_such_module\nsetup()\n")
    assert catkin_make.main([]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert [line for line in lines if " * " in line] == [
        f"\x1b[31m * one: {folder / 'setup.py'} failed: ModuleNotFoundError: "
        "No module named 'no_such_module'\x1b[0m"
    ]


@pytest.mark.needs("resource limits")
def test_on_a_full_disk_the_package_and_its_file_are_named_and_others_are_built(
    base: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (base / "src" / "one" / "CMakeLists.txt").write_text(
        "project(one)\nfind_package(catkin REQUIRED COMPONENTS message_generation)\n"
        "add_message_files(FILES Large.msg)\ngenerate_messages()\ncatkin_package()\n"
    )
    (base / "src" / "one" / "msg").mkdir()
    (base / "src" / "one" / "msg" / "Large.msg").write_text("".join(f"int32 field_{n}\n" for n in range(999)))

    with files_limited_to(10_000):
        assert catkin_make.main([]) == 1

    stubs = base / "devel/lib/python3/dist-packages/one/msg/__init__.pyi"
    told = capsys.readouterr()
    assert f"* one: [Errno {errno.EFBIG}] {os.strerror(errno.EFBIG)}: '{stubs}'" in told.err
    assert list(json.loads((base / "build/pipros/state.json").read_text())) == ["two"]
    assert not list(base.rglob("*.active"))
    assert catkin_make.main([]) == 0
    assert "field_998" in stubs.read_text()


@pytest.mark.needs("resource limits")
def test_on_a_full_disk_the_marker_of_the_workspace_is_named(
    base: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(catkin_make, "_MARKER_TEXT", "#" * 9000)

    with files_limited_to(5000):
        assert catkin_make.main([]) == 1

    assert f"'{base / '.catkin_workspace'}'" in capsys.readouterr().err
    assert not (base / ".catkin_workspace").exists()
