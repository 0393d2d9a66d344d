from __future__ import annotations

import os
from pathlib import Path

import pytest

from pipros_tools.cli import catkin_find, catkin_make_isolated, catkin_topological_order
from tests.support.workspaces import Workspace

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


def test_each_package_has_a_devel_space_above_those_before(
    workspace: Workspace, capsys: pytest.CaptureFixture[str]
) -> None:
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
def test_packages_are_chosen(
    workspace: Workspace, arguments: list[str], processed: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert catkin_make_isolated.main([]) == 0
    capsys.readouterr()
    catkin_make_isolated.main(arguments)
    lines = capsys.readouterr().out.splitlines()
    assert [line.split("'")[1] for line in lines if line.startswith("==> Processing")] == processed


def test_a_first_package_that_is_not_to_be_built_is_named(
    workspace: Workspace, capsys: pytest.CaptureFixture[str]
) -> None:
    assert catkin_make_isolated.main(["--merge", "--only-pkg-with-deps", "zero", "--from-pkg", "one"]) == 1
    assert "--from-pkg one is not among the packages to build" in capsys.readouterr().err


def test_settings_reach_the_packages(workspace: Workspace, capsys: pytest.CaptureFixture[str]) -> None:
    workspace.add("two", 'message(STATUS "X is ${X}")')
    assert catkin_make_isolated.main(["--pkg", "two", "--cmake-args", "-DX:STRING=7"]) == 0
    assert "-- X is 7" in capsys.readouterr().out


def test_a_failed_package_ends_the_build_and_shows_its_output(
    workspace: Workspace, capsys: pytest.CaptureFixture[str]
) -> None:
    workspace.add("broken", "nonsense()", "zero")
    assert catkin_make_isolated.main(["-q"]) == 1
    printed = capsys.readouterr()
    assert "(nonsense)" in printed.out
    assert "<== Failed to process package 'broken'" in printed.out
    assert "Generating Python" not in printed.out
    assert 'Unknown CMake command "nonsense"' in printed.err
    assert printed.err.endswith("Command failed, exiting.\n")


def test_compiled_code_without_cmake_says_what_to_install(
    workspace: Workspace, capsys: pytest.CaptureFixture[str]
) -> None:
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
def test_compiled_code_and_what_it_needs_are_built_by_genuine_catkin(
    workspace: Workspace, tools: Path, capsys: pytest.CaptureFixture[str]
) -> None:
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
def test_a_package_without_catkin_is_built_and_installed_by_cmake(
    workspace: Workspace, tools: Path, words: str
) -> None:
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
def test_a_package_whose_cmake_fails_ends_the_build(
    workspace: Workspace, tools: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tools.parent / "fails").touch()
    manifest = workspace.add("plain") / "package.xml"
    manifest.write_text(manifest.read_text().replace("</package>", f"{PLAIN}</package>"))

    assert catkin_make_isolated.main(["--pkg", "plain"]) == 1

    assert "plain: Invoking" in capsys.readouterr().err


def test_files_are_found_in_workspaces_sources_and_pipros(
    workspace: Workspace, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
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


def test_packages_are_listed_in_the_order_of_their_needs(
    workspace: Workspace, capsys: pytest.CaptureFixture[str]
) -> None:
    assert catkin_topological_order.main(["src", "--only-names"]) == 0
    assert capsys.readouterr().out == "zero\none\n"
    assert catkin_topological_order.main(["nowhere"]) == 1
    (workspace.base / "empty").mkdir()
    assert catkin_topological_order.main(["empty"]) == 3
