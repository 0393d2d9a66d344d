"""Commands of CMake and catkin in packages: custom commands, installation, hooks, tests."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from pipros.basics.extras import install_command
from pipros_workspace.catkin import templates
from pipros_workspace.cmake import cmake_command
from pipros_workspace.hooks import find_hooks
from pipros_workspace.make_targets import label, names, results_label
from tests.support.workspaces import Workspace


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    return Workspace(tmp_path)


def touch_later(file: Path) -> None:
    """Make a file newer than everything created so far."""
    later = max(path.stat().st_mtime_ns for path in file.parents[2].rglob("*")) + 1_000_000_000
    os.utime(file, ns=(later, later))


COPY = (
    "add_custom_command(OUTPUT made/b.txt COMMAND ${CMAKE_COMMAND} -E copy ${CMAKE_CURRENT_SOURCE_DIR}/a.txt "
    '${CMAKE_CURRENT_BINARY_DIR}/made/b.txt DEPENDS a.txt COMMENT "making b")\n'
)


def test_a_loop_repeats_while_its_condition_holds(workspace: Workspace) -> None:
    workspace.add(
        "p", 'set(i 0)\nwhile(i LESS 3)\n  math(EXPR i "${i}+1")\n  message(STATUS "i ${i}")\nendwhile()'
    )
    workspace.build()
    assert [line for line in workspace.lines if line.startswith("-- i ")] == ["-- i 1", "-- i 2", "-- i 3"]


def test_an_infinite_loop_is_stopped(workspace: Workspace) -> None:
    folder = workspace.add("p", "while(TRUE)\nendwhile()")
    (error,) = workspace.build().errors
    assert f"{folder / 'CMakeLists.txt'}:3 (while)" in error
    assert "iterations" in error


@pytest.mark.needs("first lines")
def test_commands_that_make_installed_files_run_without_cmake(workspace: Workspace) -> None:
    folder = workspace.add(
        "p", COPY + "install(FILES ${CMAKE_CURRENT_BINARY_DIR}/made/b.txt DESTINATION share/p)", a_dot_txt="a"
    )
    result = workspace.build(installs=True)
    assert result.errors == []
    assert "making b" in workspace.lines
    assert (workspace.layout.install / "share/p/b.txt").read_text() == "a"
    assert workspace.build().unchanged == ["p"]
    (folder / "a.txt").write_text("changed")
    touch_later(folder / "a.txt")
    assert workspace.build(installs=True).built == ["p"]
    assert (workspace.layout.install / "share/p/b.txt").read_text() == "changed"


def test_an_unneeded_file_is_not_made(workspace: Workspace) -> None:
    workspace.add("p", COPY, a_dot_txt="a")
    workspace.build()
    assert not (workspace.layout.build / "p/made").exists()


@pytest.mark.needs("first lines")
def test_targets_of_all_are_run_in_the_order_of_their_needs(workspace: Workspace) -> None:
    workspace.add(
        "p",
        COPY + "add_custom_target(first COMMAND ${CMAKE_COMMAND} -E touch first.txt)\n"
        "add_custom_target(all_of_it ALL COMMAND ${CMAKE_COMMAND} -E copy made/b.txt first.txt d "
        "DEPENDS made/b.txt)\nadd_dependencies(all_of_it first)\n"
        "file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/d)\n"
        "add_custom_target(never COMMAND ${CMAKE_COMMAND} -E touch never.txt)\n"
        "add_custom_command(TARGET all_of_it POST_BUILD COMMAND cd d && ${CMAKE_COMMAND} -E touch after.txt)",
        a_dot_txt="a",
    )
    assert workspace.build().errors == []
    made = workspace.layout.build / "p"
    assert {path.name for path in (made / "d").iterdir()} == {"b.txt", "first.txt", "after.txt"}
    assert not (made / "never.txt").exists()
    assert workspace.build().built == ["p"]  # a target has no files that could be up to date


@pytest.mark.needs("first lines")
def test_a_command_that_fails_is_named_with_its_line(workspace: Workspace) -> None:
    folder = workspace.add("p", "add_custom_target(bad ALL COMMAND ${CMAKE_COMMAND} -E false)")
    workspace.add("fine")
    result = workspace.build()
    (error,) = result.errors
    assert f"CMake Error at {folder / 'CMakeLists.txt'}:3:\n  the command [" in error
    assert "-E false] of [bad] failed with exit code 1" in error
    assert "fine" in result.built


def test_commands_read_the_variables_of_noetic_in_a_bare_shell(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROS_DISTRO", raising=False)
    code = f"{sys.executable} -c \"import os; open('distro', 'w').write(os.environ['ROS_DISTRO'])\""
    workspace.add("p", f"add_custom_target(t ALL COMMAND {code})")
    assert (workspace.build().errors, (workspace.base / "build/p/distro").read_text()) == ([], "noetic")


def test_a_missing_file_without_a_rule_is_named(workspace: Workspace) -> None:
    workspace.add("p", "add_custom_target(bad ALL DEPENDS ${CMAKE_CURRENT_BINARY_DIR}/nope.txt)")
    (error,) = workspace.build().errors
    assert "No rule to make target" in error
    assert "nope.txt', needed by 'bad'" in error


@pytest.mark.parametrize(("line", "what"), [
    (
        "add_custom_target(t ALL COMMAND echo $<TARGET_FILE:x>)",
        "the generator expression $<TARGET_FILE:x>",
    ),
    ("add_custom_target(t ALL COMMAND a | b)", "the shell that [a | b] needs"),
    ("file(GENERATE OUTPUT x CONTENT y)", "file(GENERATE)"), ("string(JSON x GET y z)", "string(JSON)"),
    ("try_compile(x y z)", "try_compile()"),
    ("find_package(Foo)\nfoo_make(x)", "foo_make(), which another package provides"),
    ("include(ExternalProject)\nExternalProject_Add(x)", "ExternalProject_Add(), which another package"),
])  # fmt: skip
def test_commands_that_only_cmake_can_run_are_refused_without_it(
    workspace: Workspace, line: str, what: str
) -> None:
    folder = workspace.add("p", line)
    (error,) = workspace.build().errors
    number = 3 + line.count("\n")
    assert f"{folder / 'CMakeLists.txt'}:{number}: the package [p] needs {what}" in error
    assert "only CMake itself" in error
    assert "Install CMake" in error


CONFIGURABLE = (
    "find_package(catkin REQUIRED COMPONENTS dynamic_reconfigure)\n"
    "generate_dynamic_reconfigure_options(cfg/P.cfg)\ncatkin_package()"
)
CFG = """
from dynamic_reconfigure.parameter_generator_catkin import ParameterGenerator, int_t
gen = ParameterGenerator()
gen.add("speed", int_t, 0, "How quick", 5, 0, 10)
exit(gen.generate("p", "p", "P"))
"""


def test_cfg_files_are_read_and_installed(workspace: Workspace) -> None:
    workspace.add("p", CONFIGURABLE, "dynamic_reconfigure", cfg__P_dot_cfg=CFG)
    result = workspace.build(installs=True)
    assert result.errors == []
    assert "Generating dynamic reconfigure files from cfg/P.cfg" in workspace.lines
    assert (workspace.base / "devel/lib/python3/dist-packages/p/__init__.py").is_file()
    assert (workspace.base / "install/share/p/cfg/P.cfg").read_text() == CFG
    assert workspace.build(installs=True).unchanged == ["p"]


@pytest.mark.parametrize("name", ["dynamic_reconfigure", "config"])
def test_cfg_files_of_other_folders_are_modules_of_the_built_package(workspace: Workspace, name: str) -> None:
    text = CONFIGURABLE.replace("cfg/P.cfg", f"{name}/P.cfg")
    folder = workspace.add("p", text, "dynamic_reconfigure", cfg__P_dot_cfg=CFG)
    (folder / "cfg").rename(folder / name)
    result = workspace.build(installs=True)
    assert result.errors == []
    for space in ("devel/lib", "install/lib"):
        code = "from p.cfg import PConfig; print(PConfig.defaults)"
        path = {
            "PYTHONPATH": str(workspace.base / space / "python3/dist-packages"),
            "ROS_PACKAGE_PATH": str(workspace.base / ("src" if space == "devel/lib" else "install/share")),
        }
        ran = subprocess.run(
            [sys.executable, "-c", code], env={**os.environ, **path}, capture_output=True, text=True,
            check=False, timeout=60,
        )  # fmt: skip
        assert ran.stdout == "{'speed': 5}\n", ran.stderr


def test_a_cfg_file_that_fails_or_is_not_there_fails_its_package(workspace: Workspace) -> None:
    folder = workspace.add("p", CONFIGURABLE, "dynamic_reconfigure", cfg__P_dot_cfg="1 / 0")
    (error,) = workspace.build().errors
    assert f"{folder}/cfg/P.cfg declared no parameters" in error
    assert "ZeroDivisionError" in error
    (folder / "cfg" / "P.cfg").unlink()
    (error,) = workspace.build().errors
    assert f"{folder}/cfg/P.cfg does not exist; {folder / 'CMakeLists.txt'} names it" in error


@pytest.mark.parametrize("place", ["workspace", "underlay"])
def test_a_package_may_have_cmake_code_for_others(
    workspace: Workspace, place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    below = workspace if place == "workspace" else Workspace(workspace.base / "below")
    folder = below.add(
        "tools",
        "find_package(user)\ncatkin_package(CFG_EXTRAS tools.cmake values.cmake)",
        cmake__tools_dot_cmake='function(say_it text)\n  message(STATUS "it: ${text}")\nendfunction()\n',
        cmake__values_dot_cmake_dot_in="set(TOOLS_OF @PROJECT_NAME@ @PROJECT_SOURCE_DIR@ @DEVELSPACE@)\n",
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(below.base / "src"))
    workspace.add("user", 'find_package(catkin REQUIRED COMPONENTS tools)\nsay_it("${TOOLS_OF}")', "tools")
    assert workspace.build().errors == []
    assert f"-- it: tools;{folder};TRUE" in workspace.lines


def test_settings_of_the_command_line_win_over_the_cache_and_options(workspace: Workspace) -> None:
    workspace.add(
        "p", 'set(A 1 CACHE STRING "")\noption(B "" ON)\nset(C 3)\nmessage(STATUS "${A} ${B} ${C} ${D}")'
    )
    workspace.build(definitions={"A": "7", "B": "OFF", "C": "9", "D": "d"})
    assert "-- 7 OFF 3 d" in workspace.lines


def test_a_package_has_its_path(workspace: Workspace) -> None:
    written = (
        "${CMAKE_SOURCE_DIR} ${CMAKE_BINARY_DIR} ${CMAKE_CURRENT_BINARY_DIR} ${CATKIN_DEVEL_PREFIX} "
        "${PROJECT_VERSION} ${p_VERSION}"
    )
    workspace.add("p", f'catkin_package()\nmessage(STATUS "{written}")')
    workspace.build()
    base = workspace.base
    assert f"-- {base}/src {base}/build {base}/build/p {base}/devel  0.1.0" in workspace.lines


def test_folders_are_installed_as_cmake_installs_them(workspace: Workspace) -> None:
    folder = workspace.add(
        "p",
        'install(DIRECTORY data DESTINATION share/p PATTERN "*.bak" EXCLUDE PATTERN no EXCLUDE)\n'
        'install(DIRECTORY data/ DESTINATION share/p/flat FILES_MATCHING PATTERN "*.sh" PERMISSIONS '
        'OWNER_READ OWNER_EXECUTE REGEX "/deep/")\n'
        "install(DIRECTORY data/ DESTINATION share/p/kept USE_SOURCE_PERMISSIONS)\n"
        "install(FILES data/a.txt DESTINATION share/p RENAME b.txt)\n"
        "install(FILES nope DESTINATION share/p OPTIONAL)\n"
        "install(DIRECTORY nope DESTINATION share/p)\n"
        'install(CODE "file(WRITE \\${CMAKE_INSTALL_PREFIX}/code.txt ${PROJECT_NAME})")',
        data__a_dot_txt="a",
        data__a_dot_bak="a",
        data___dot_hidden="h",
        data__run_dot_sh="r",
        data__no__n_dot_txt="n",
        data__deep__d_dot_txt="d",
    )
    (folder / "data/run.sh").chmod(0o755)
    assert workspace.build(installs=True).errors == []
    share = workspace.layout.install / "share/p"
    modes = {
        str(path.relative_to(share)): oct(path.stat().st_mode & 0o777)
        for path in share.rglob("*")
        if path.is_file() and path.name != "package.xml"
    }
    assert modes == {
        "b.txt": "0o644", "data/a.txt": "0o644", "data/.hidden": "0o644", "data/run.sh": "0o644",
        "data/deep/d.txt": "0o644", "flat/run.sh": "0o500", "flat/deep/d.txt": "0o644", "kept/a.txt": "0o644",
        "kept/a.bak": "0o644", "kept/.hidden": "0o644", "kept/run.sh": "0o755", "kept/no/n.txt": "0o644",
        "kept/deep/d.txt": "0o644",
    }  # fmt: skip
    assert (workspace.layout.install / "code.txt").read_text() == "p"


def test_a_file_to_be_installed_that_is_missing_is_named(workspace: Workspace) -> None:
    workspace.add("p", "install(FILES nope.txt DESTINATION share/p)")
    assert workspace.build().errors == []
    (error,) = workspace.build(installs=True).errors
    assert 'file INSTALL cannot find "' in error
    assert "p/nope.txt" in error


def test_installed_scripts_name_python_3(workspace: Workspace) -> None:
    workspace.add(
        "p",
        "catkin_install_python(PROGRAMS a.py b.py DESTINATION lib/p)",
        a_dot_py="#! /opt/bin/env  python \r\nprint()\n",
        b_dot_py="#!/usr/bin/python\n",
    )
    workspace.build(installs=True)
    place = workspace.layout.install / "lib/p"
    assert (place / "a.py").read_bytes() == b"#!/opt/bin/env python3\r\nprint()\n"
    assert (place / "b.py").read_text() == "#!/usr/bin/python\n"


def test_environment_hooks_are_put_where_setup_files_find_them(workspace: Workspace) -> None:
    workspace.add(
        "p",
        "catkin_add_env_hooks(10.p SHELLS sh bash DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/env-hooks)",
        **{
            "env-hooks__10_dot_p_dot_sh": "export P=1\n",
            "env-hooks__10_dot_p_dot_bash_dot_in": "export P=@PROJECT_NAME@ # ${P}\n",
        },
    )
    assert workspace.build(installs=True).errors == []
    for space in (workspace.layout.devel, workspace.layout.install):
        place = space / "etc/catkin/profile.d"
        assert (place / "10.p.sh").read_text() == "export P=1\n"
        assert (place / "10.p.bash").read_text() == "export P=p # ${P}\n"
    hooks = find_hooks([workspace.layout.install, workspace.layout.devel], "bash")
    assert [(hook.workspace.name, hook.file.name) for hook in hooks] == [
        ("install", "10.p.sh"),
        ("install", "10.p.bash"),
    ]
    assert find_hooks([workspace.layout.devel], "fish") == []


def test_tests_have_the_target_names_of_catkin(workspace: Workspace) -> None:
    workspace.add(
        "p",
        "find_package(rostest)\nfind_package(roslaunch)\n"
        "add_rostest(test/x.test)\nadd_rostest(test/x.test ARGS a:=1 b:=two/three)\n"
        "add_rostest(test/x.test ARGS a:=0.5)\n"
        "roslaunch_add_file_check(test)\nroslaunch_add_file_check(test/x.test x:=1 IGNORE_UNSET_ARGS)",
        test__x_dot_test="<launch/>",
    )
    projects = workspace.build().projects
    tests = projects["p"].tests
    assert [results_label(test) for test in tests if test.kind == "rostest"] == [
        "test_x", "x__a_1__b_two_three", "x__a_0"
    ]  # fmt: skip
    assert [label(test) for test in tests if test.kind == "roslaunch"] == ["test", "x__x_1.test"]
    assert {
        "run_tests_p_rostest", "run_tests_p_rostest_test_x.test",
        "run_tests_p_rostest_x__a_1__b_two_three.test", "run_tests_p_roslaunch-check_x__x_1.test",
        "clean_test_results_p",
    } <= set(names(projects))  # fmt: skip


@pytest.mark.parametrize(
    "line", ["add_rostest(nope.test)", "catkin_add_nosetests(nope)", "roslaunch_add_file_check(nope)"]
)
def test_a_test_that_does_not_exist_is_named(workspace: Workspace, line: str) -> None:
    workspace.add("p", f"find_package(rostest)\nfind_package(roslaunch)\n{line}")
    (error,) = workspace.build().errors
    assert "CMakeLists.txt:5 (" in error
    assert "does not exist" in error


@pytest.mark.parametrize(("words", "code", "printed"), [
    (["-E", "echo", "a", "b"], 0, "a b\n"), (["-E", "true"], 0, ""), (["-E", "false"], 1, ""),
    (["-E", "copy", "a.txt", "b.txt"], 0, ""), (["-E", "cat", "a.txt"], 0, "a"),
    (["-E", "compare_files", "a.txt", "a.txt"], 0, ""), (["-E", "copy", "nope", "b"], 1, ""),
    (["-E", "rename", "a.txt"], 1, ""), (["-E", "nonsense"], 1, ""), (["--build", "."], 1, ""),
])  # fmt: skip
def test_the_stand_in_for_cmake(
    words: list[str],
    code: int,
    printed: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "a.txt").write_text("a")
    monkeypatch.chdir(tmp_path)
    assert (cmake_command.main(words), capsys.readouterr().out) == (code, printed)


HOOK = """\
@[if DEVELSPACE]@
export P_MAPS=@(CMAKE_CURRENT_SOURCE_DIR)/maps
@[else]@
export P_MAPS=@(CMAKE_INSTALL_PREFIX)/@(CATKIN_PACKAGE_SHARE_DESTINATION)/maps
@[end if]@
"""


@pytest.mark.parametrize("ending", ["em", "develspace_dot_em"])
def test_environment_hooks_are_made_from_templates(workspace: Workspace, ending: str) -> None:
    hook = {f"env-hooks__25_dot_p_dot_sh_dot_{ending}": HOOK}
    folder = workspace.add("p", "catkin_add_env_hooks(25.p SHELLS sh)\ncatkin_package()", **hook)
    assert workspace.build(installs=True).errors == []
    made = [workspace.base / space / "etc/catkin/profile.d/25.p.sh" for space in ("devel", "install")]
    assert made[0].read_text() == f"export P_MAPS={folder}/maps\n"
    assert made[1].read_text() == f"export P_MAPS={workspace.base}/install/share/p/maps\n"


def test_cmake_code_for_others_is_made_from_templates(workspace: Workspace) -> None:
    workspace.add(
        "tools",
        "catkin_package(CFG_EXTRAS tools.cmake)",
        cmake__tools_dot_cmake_dot_em="@[if DEVELSPACE]@\n"
        "set(TOOLS_DIR @(PROJECT_SOURCE_DIR)/bin)\n@[end if]@\n"
        'function(say_it text)\n  message(STATUS "@(PROJECT_NAME): ${text}")\nendfunction()\n',
    )
    workspace.add("user", "find_package(catkin REQUIRED tools)\nsay_it(${TOOLS_DIR})", "tools")
    assert workspace.build().errors == []
    assert f"-- tools: {workspace.base}/src/tools/bin" in workspace.lines


def test_a_package_expands_templates_itself(workspace: Workspace) -> None:
    workspace.add(
        "p",
        "set(WORD hello)\nem_expand(cmake/c.py.in ${CMAKE_CURRENT_BINARY_DIR}/c.py cmake/t.txt.em"
        " ${CMAKE_CURRENT_BINARY_DIR}/made/t.txt)",
        cmake__c_dot_py_dot_in="word = '@WORD@'\n",
        cmake__t_dot_txt_dot_em="@(word.upper())\n",
    )
    assert workspace.build().errors == []
    assert (workspace.base / "build/p/made/t.txt").read_text() == "HELLO\n"


@pytest.mark.parametrize(("arguments", "words"), [
    ("a b c", "incorrect number of arguments"), ("a b c d", "does not exist"),
    ("c.in c.py bad.em t", "the template .*bad.em failed:.*ZeroDivisionError"),
])  # fmt: skip
def test_a_template_that_fails_is_named_with_its_line(
    workspace: Workspace, arguments: str, words: str
) -> None:
    workspace.add("p", f"em_expand({arguments})", bad_dot_em="@(1 / 0)", c_dot_in="")
    (error,) = workspace.build().errors
    assert re.search(rf"CMakeLists\.txt:3.*{words}", error, re.DOTALL), error


@pytest.mark.parametrize("line", [
    "catkin_add_env_hooks(25.p SHELLS sh)", "em_expand(c.in c.py env-hooks/25.p.sh.em t)",
    "find_package(catkin REQUIRED tools)\nsay_it(x)",
])  # fmt: skip
def test_without_empy_3_one_error_says_how_to_get_it(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch, line: str
) -> None:
    def version(_name: str) -> str:
        return "4.2"

    monkeypatch.setattr(templates, "version", version)
    workspace.add("tools", "catkin_package(CFG_EXTRAS t.cmake)", cmake__t_dot_cmake_dot_em="")
    files = {"env-hooks__25_dot_p_dot_sh_dot_em": HOOK, "c_dot_in": ""}
    workspace.add("p", line, "tools", **files)
    (error,) = workspace.build().errors
    assert install_command("templates") in error
    assert "p/CMakeLists.txt:" in error


@pytest.mark.parametrize("ending", ["cmake", "cmake_dot_em"])
def test_a_package_can_use_its_own_extras_after_catkin_package(workspace: Workspace, ending: str) -> None:
    macro = 'macro(check_it word)\n  message(STATUS "checked ${word}")\nendmacro()\n'
    used = "catkin_package(CFG_EXTRAS check.cmake)\nfind_package(p REQUIRED)\ncheck_it(now)"
    workspace.add("p", used, **{f"cmake__check_dot_{ending}": macro})
    result = workspace.build()
    assert result.errors == []
    assert "-- checked now" in workspace.lines


def test_a_macro_of_own_extras_that_were_not_found_is_explained(workspace: Workspace) -> None:
    workspace.add(
        "p",
        "find_package(other)\ncatkin_package(CFG_EXTRAS check.cmake)\ncheck_it(now)",
        cmake__check_dot_cmake="macro(check_it word)\nendmacro()\n",
    )
    (error,) = workspace.build().errors
    assert (
        "needs check_it(), which the package's own check.cmake defines: call find_package(p) after" in error
    )
