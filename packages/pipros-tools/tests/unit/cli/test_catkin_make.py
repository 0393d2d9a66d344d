import errno
import json
import os
from pathlib import Path

import pytest

from pipros_tools.cli import (
    catkin_create_pkg,
    catkin_find,
    catkin_init_workspace,
    catkin_make,
    catkin_make_isolated,
    catkin_test_results,
    catkin_topological_order,
)
from tests.support.full_disk import files_limited_to
from tests.support.workspaces import Workspace

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
def test_packages_are_chosen(base: Path, arguments: list[str], built: list[str], capsys) -> None:
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
        "Full test results for 'test_results/one/bad.xml'", "-" * 49,
        '<testsuite tests="2" errors="1" failures="1" skip="1"/>', "-" * 49,
        "test_results/one/bad.xml: 2 tests, 1 errors, 1 failures, 1 skipped",
        "test_results/one/good.xml: 3 tests", "Summary: 5 tests, 1 errors, 1 failures, 1 skipped",
    ]  # fmt: skip
    assert catkin_test_results.main(["/nowhere"]) == 1
    assert capsys.readouterr().err == 'Test results directory "/nowhere" does not exist\n'


def test_the_summary_of_a_failure_has_place_and_reason(base: Path, capsys) -> None:
    file = base / "src/one/CMakeLists.txt"
    file.write_text('project(one)\nmessage(FATAL_ERROR "No such\nrobot.  Buy it.")\ncatkin_package()\n')
    assert catkin_make.main([]) == 1
    shown = [line for line in capsys.readouterr().err.splitlines() if " * " in line]
    assert shown == [f"\x1b[31m * one: CMake Error at {file}:2 (message): No such robot\x1b[0m"]


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
def test_on_a_full_disk_the_package_and_its_file_are_named_and_others_are_built(base: Path, capsys) -> None:
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
def test_on_a_full_disk_the_marker_of_the_workspace_is_named(base: Path, capsys, monkeypatch) -> None:
    monkeypatch.setattr(catkin_make, "_MARKER_TEXT", "#" * 9000)

    with files_limited_to(5000):
        assert catkin_make.main([]) == 1

    assert f"'{base / '.catkin_workspace'}'" in capsys.readouterr().err
    assert not (base / ".catkin_workspace").exists()


@pytest.mark.parametrize(("arguments", "message"), [
    (["a", "-V", "bad"], 'Package version "bad" does not follow version conventions'),
    (["a/b"], 'Package name "a/b" does not follow naming conventions'),
    (["a", "a"], 'The package "a" must not'),
])  # fmt: skip
def test_a_package_that_cannot_be_made_is_reported_in_one_line(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert catkin_create_pkg.main(arguments) == 1
    assert capsys.readouterr().err.startswith(f"catkin_create_pkg: error: {message}")
    assert list(tmp_path.iterdir()) == []


EXTRAS = 'function(hello)\n  message(STATUS "hello from ${PROJECT_NAME}")\nendfunction()\n'


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    """Two packages, the second of which needs the first, on a machine without CMake."""
    workspace = Workspace(tmp_path)
    workspace.add("zero", "catkin_package(CFG_EXTRAS x.cmake)", cmake__x_dot_cmake=EXTRAS)
    workspace.add(
        "one",
        "find_package(catkin REQUIRED zero message_generation)\nhello()\nadd_message_files(FILES A.msg)\n"
        "generate_messages()\ncatkin_package()",
        "zero",
        msg__A_dot_msg="int32 a\n",
    )
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.delenv("CMAKE_PREFIX_PATH", raising=False)
    monkeypatch.chdir(tmp_path)
    return workspace


def test_each_package_has_a_devel_space_above_those_before(workspace: Workspace, capsys) -> None:
    assert catkin_make_isolated.main([]) == 0
    printed = capsys.readouterr().out
    assert "-- hello from one" in printed
    assert "<== Finished processing package [2 of 2]: 'one'" in printed
    devel = workspace.base / "devel_isolated"
    assert (devel / "one" / ".catkin").read_text() == str(workspace.base / "src" / "one")
    assert (devel / "one" / ".pipros_underlays").read_text() == f"{devel / 'zero'}\0"
    assert (devel / "one/lib/python3/dist-packages/one/__init__.py").is_file()
    assert f". {devel / 'one' / 'setup.bash'}" in (devel / "setup.bash").read_text()
    assert (workspace.base / ".catkin_workspace").is_file()


def test_merged_packages_share_a_devel_space(workspace: Workspace) -> None:
    assert catkin_make_isolated.main(["--merge", "--devel", "common", "--install"]) == 0
    sources = [workspace.base / "src" / name for name in ("zero", "one")]
    assert (workspace.base / "common" / ".catkin").read_text() == ";".join(map(str, sources))
    assert (workspace.base / "install_isolated/share/one/msg/A.msg").is_file()


@pytest.mark.parametrize(("arguments", "processed"), [
    (["--pkg", "one"], ["one"]), (["--from-pkg", "one"], ["one"]), (["--ignore-pkg", "one"], ["zero"]),
    (["--merge", "--only-pkg-with-deps", "zero"], ["zero"]),
    (["-j4", "--cmake-args", "-DX=1", "--make-args", "-l2"], ["zero", "one"]),
])  # fmt: skip
def test_packages_of_an_isolated_build_are_chosen(
    workspace: Workspace, arguments: list[str], processed: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert catkin_make_isolated.main([]) == 0
    capsys.readouterr()
    catkin_make_isolated.main(arguments)
    lines = capsys.readouterr().out.splitlines()
    assert [line.split("'")[1] for line in lines if line.startswith("==> Processing")] == processed


def test_a_first_package_that_is_not_to_be_built_is_named(workspace: Workspace, capsys) -> None:
    assert catkin_make_isolated.main(["--merge", "--only-pkg-with-deps", "zero", "--from-pkg", "one"]) == 1
    assert "--from-pkg one is not among the packages to build" in capsys.readouterr().err


def test_settings_reach_the_packages(workspace: Workspace, capsys: pytest.CaptureFixture[str]) -> None:
    workspace.add("two", 'message(STATUS "X is ${X}")')
    assert catkin_make_isolated.main(["--pkg", "two", "--cmake-args", "-DX:STRING=7"]) == 0
    assert "-- X is 7" in capsys.readouterr().out


def test_a_failed_package_ends_the_build_and_shows_its_output(workspace: Workspace, capsys) -> None:
    workspace.add("broken", "nonsense()", "zero")
    assert catkin_make_isolated.main(["-q"]) == 1
    printed = capsys.readouterr()
    assert "(nonsense)" in printed.out
    assert "<== Failed to process package 'broken'" in printed.out
    assert "Generating Python" not in printed.out
    assert 'Unknown CMake command "nonsense"' in printed.err
    assert printed.err.endswith("Command failed, exiting.\n")


def test_compiled_code_without_cmake_says_what_to_install(workspace: Workspace, capsys) -> None:
    workspace.add("cpp", "add_executable(x x.cpp)")
    assert catkin_make_isolated.main([]) == 1
    assert "the package [cpp] must be built by genuine catkin, but cmake" in capsys.readouterr().err


@pytest.fixture
def tools(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file to which fake CMake and make write their arguments and working directories."""
    log = tmp_path / "called"
    (tmp_path / "bin").mkdir()
    for name in ("cmake", "make", "c++"):
        program = tmp_path / "bin" / name
        program.write_text(f"#!/bin/sh\necho {name} $(pwd) $* >> {log}\n[ ! -e {tmp_path}/fails ]\n")
        program.chmod(0o755)
    toplevel = tmp_path / "opt/share/catkin/cmake/toplevel.cmake"
    toplevel.parent.mkdir(parents=True)
    toplevel.touch()
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:/usr/bin:/bin")
    monkeypatch.setenv("CMAKE_PREFIX_PATH", str(tmp_path / "opt"))
    return log


@pytest.mark.needs("first lines")
def test_compiled_code_and_what_it_needs_are_built_by_genuine_catkin(workspace, tools: Path, capsys) -> None:
    workspace.add("cpp", "add_executable(x x.cpp)", "zero")

    assert catkin_make_isolated.main([]) == 0

    folders = [line.split()[1] for line in tools.read_text().splitlines() if line.startswith("cmake ")]
    build = f"{workspace.base}/build_isolated"
    assert folders == [f"{build}/{name}/pipros/native/build" for name in ("zero", "cpp")]
    assert (
        "==> The package 'cpp' needs CMake: genuine catkin builds it and its dependencies"
        in capsys.readouterr().out
    )


PLAIN = "<export><build_type>cmake</build_type></export>"


@pytest.mark.needs("first lines")
@pytest.mark.parametrize("words", ["", "--install", "--merge -q"])
def test_a_package_without_catkin_is_built_and_installed_by_cmake(workspace, tools: Path, words: str) -> None:
    manifest = workspace.add("plain") / "package.xml"
    manifest.write_text(manifest.read_text().replace("</package>", f"{PLAIN}</package>"))

    assert catkin_make_isolated.main(["--pkg", "plain", *words.split()]) == 0

    base = workspace.base
    devel = base / "devel_isolated" if "--merge" in words else base / "devel_isolated" / "plain"
    prefix = base / "install_isolated" if "--install" in words else devel
    build = base / "build_isolated" / "plain"
    configured, *made = tools.read_text().splitlines()
    assert configured.startswith(f"cmake {build} {base}/src/plain -DCMAKE_INSTALL_PREFIX={prefix} -G ")
    assert made == [f"make {build} -j{os.cpu_count()}", f"make {build} install"]
    assert (devel / ".catkin").read_text().endswith(f"{base}/src/plain")
    assert (prefix / "setup.sh").is_file()


@pytest.mark.needs("first lines")
def test_a_package_whose_cmake_fails_ends_the_build(workspace: Workspace, tools: Path, capsys) -> None:
    (tools.parent / "fails").touch()
    manifest = workspace.add("plain") / "package.xml"
    manifest.write_text(manifest.read_text().replace("</package>", f"{PLAIN}</package>"))

    assert catkin_make_isolated.main(["--pkg", "plain"]) == 1

    assert "plain: Invoking" in capsys.readouterr().err


def test_files_are_found_in_workspaces_sources_and_pipros(workspace: Workspace, capsys, monkeypatch) -> None:
    assert catkin_make_isolated.main(["--merge", "--install"]) == 0
    prefixes = [str(workspace.base / name) for name in ("devel_isolated", "install_isolated")]
    monkeypatch.setenv("CMAKE_PREFIX_PATH", ":".join(prefixes))

    def found(*arguments: str) -> list[str]:
        capsys.readouterr()
        assert catkin_find.main(arguments) == 0
        return capsys.readouterr().out.splitlines()

    source = str(workspace.base / "src" / "one")
    assert found("one", "--share") == [source, f"{prefixes[1]}/share/one"]
    assert found("one", "msg/A.msg", "--first-only") == [f"{source}/msg/A.msg"]
    assert found("one", "--without-underlays") == [source]
    assert found("rospy")[0].endswith("/share/rospy")
    assert found("nope") == []
    assert f"{prefixes[1]}/share" in found("--share")
    assert catkin_find.main(["nope", "--first-only"]) == 1
    assert f"{prefixes[0]}/share/nope" in capsys.readouterr().err
    assert (catkin_find.main(["one", "--bin"]), catkin_find.main(["--libexec"])) == (1, 1)


def test_packages_are_listed_in_the_order_of_their_needs(workspace: Workspace, capsys) -> None:
    assert catkin_topological_order.main(["src", "--only-names"]) == 0
    assert capsys.readouterr().out == "zero\none\n"
    assert catkin_topological_order.main(["nowhere"]) == 1
    (workspace.base / "empty").mkdir()
    assert catkin_topological_order.main(["empty"]) == 3
