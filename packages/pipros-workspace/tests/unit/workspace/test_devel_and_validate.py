"""The files of a package in the devel and install spaces, and the checks before those are written."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipros_workspace.type_catalogue import ACTIONS, MESSAGES, SERVICES, expanded
from tests.support.workspaces import Workspace, hide_setuptools

MODULES = "lib/python3/dist-packages"
FIND = "find_package(catkin REQUIRED message_generation)\n"


@pytest.fixture
def workspace(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> Workspace:
    hide_setuptools(tmp_path_factory.mktemp("path"), monkeypatch)
    return Workspace(tmp_path)


def test_a_relayed_script_runs_in_its_own_folder_with_its_arguments(workspace: Workspace) -> None:
    folder = workspace.add(
        "p",
        "catkin_install_python(PROGRAMS scripts/a.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})",
        scripts__a_dot_py="import sys, beside\nprint(__name__, beside.WORD, sys.argv[1:])\n",
        scripts__beside_dot_py="WORD = 'w'\n",
    )
    assert workspace.build().errors == []
    relay = workspace.layout.devel / "lib/p/a.py"
    assert os.access(relay, os.X_OK)
    shown = subprocess.run(
        [sys.executable, relay, "b", "c d"], capture_output=True, text=True, check=True, timeout=60
    )
    assert shown.stdout == "__main__ w ['b', 'c d']\n"
    assert (folder / "scripts" / "a.py").is_file()


def test_a_script_is_relayed_from_the_folder_that_it_is_installed_to(workspace: Workspace) -> None:
    workspace.add(
        "p",
        "catkin_install_python(PROGRAMS scripts/a.py DESTINATION ${CATKIN_GLOBAL_BIN_DESTINATION})\n"
        "catkin_install_python(PROGRAMS scripts/a.py DESTINATION /nowhere)",
        scripts__a_dot_py="",
    )

    assert workspace.build().errors == []

    assert os.access(workspace.layout.devel / "bin/a.py", os.X_OK)
    assert not (workspace.layout.devel / "lib/p").exists()


def test_python_packages_are_relayed_or_empty(workspace: Workspace) -> None:
    workspace.add(
        "p",
        "catkin_python_setup()",
        setup_dot_py="from setuptools import setup\n"
        "setup(packages=['p', 'p.sub', 'bare'], package_dir={'': 'src'})\n",
        src__p__words_dot_py="WORD = 1\n",
        src__bare__x_dot_py="",
    )
    package = workspace.base / "src" / "p" / "src" / "p"
    (package / "__init__.py").write_text("from p.words import WORD\nfrom p.sub import OTHER\n")
    (package / "sub").mkdir()
    (package / "sub" / "__init__.py").write_text("OTHER = 2\n")
    assert workspace.build().errors == []
    modules = workspace.layout.devel / MODULES
    assert {str(path.relative_to(modules)) for path in modules.rglob("*.py")} == {
        "p/__init__.py",
        "bare/__init__.py",
    }
    shown = subprocess.run(
        [sys.executable, "-c", "import p, bare; print(p.WORD, p.OTHER)"],
        env={**os.environ, "PYTHONPATH": str(modules), "ROS_PACKAGE_PATH": ""},
        capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    assert shown.stdout == "1 2\n"


def test_stubs_are_written_for_editors(workspace: Workspace) -> None:
    workspace.add(
        "p", f"{FIND}add_message_files(FILES A.msg)\ngenerate_messages()", msg__A_dot_msg="int32 number\n"
    )
    assert workspace.build().errors == []
    stub = (workspace.layout.devel / MODULES / "p/msg/__init__.pyi").read_text()
    assert "class A" in stub
    assert "number: int" in stub


def test_an_installed_package_has_its_manifest_modules_and_scripts(workspace: Workspace) -> None:
    workspace.add(
        "p",
        "catkin_python_setup()",
        setup_dot_py="from setuptools import setup\n"
        "setup(packages=['p'], scripts=['bin/tool'], package_dir={'': 'src'})\n",
        src__p__words_dot_py="",
        bin__tool="#!/bin/sh\n",
    )
    (workspace.base / "src/p/src/p/__init__.py").touch()
    assert workspace.build(installs=True).errors == []
    install = workspace.layout.install
    found = {
        str(path.relative_to(install))
        for path in install.rglob("*")
        if path.is_file() and path.parent != install
    }
    assert found == {
        "share/p/package.xml", f"{MODULES}/p/__init__.py", f"{MODULES}/p/words.py", "lib/p/tool", "bin/tool",
    }  # fmt: skip
    assert os.access(install / "lib/p/tool", os.X_OK)


SETUP = """from setuptools import setup
setup(packages=['spaced', 'gone'], package_dir={'': 'src'}, py_modules=['lone'], scripts=['bin/tool'],
      data_files=[('share/p/data', ['res/table.txt'])],
      entry_points="[console_scripts]\\np_cli = lone:Program.main\\nbad = lone\\n")
"""


def test_everything_that_a_setup_py_names_is_built_and_installed(workspace: Workspace) -> None:
    workspace.add(
        "p",
        "catkin_python_setup()",
        setup_dot_py=SETUP,
        src__spaced__words_dot_py="WHO = 'no __init__.py here'\n",
        src__lone_dot_py="class Program:\n    def main():\n        print(__file__)\n        return 3\n",
        bin__tool="#!/usr/bin/env python3\nimport spaced.words\nprint(spaced.words.WHO)\n",
        res__table_dot_txt="",
    )
    assert workspace.build(installs=True).errors == []
    assert f"setup.py names {workspace.base}/src/p/src/gone, which does not exist" in workspace.output
    assert "the entry point [bad = lone] is left out" in workspace.output
    assert (workspace.layout.install / "share/p/data/table.txt").is_file()
    for prefix, lone in (
        (workspace.layout.devel, workspace.base / "src/p/src/lone.py"),
        (workspace.layout.install, workspace.layout.install / MODULES / "lone.py"),
    ):
        assert os.access(prefix / "lib/p/tool", os.X_OK)  # for rosrun; genuine catkin writes bin/tool alone
        variables = {**os.environ, "PYTHONPATH": str(prefix / MODULES)}
        for program, code, shown in (("tool", 0, "no __init__.py here"), ("p_cli", 3, str(lone))):
            ended = subprocess.run(
                [sys.executable, prefix / "bin" / program], env=variables, capture_output=True, text=True
            )
            assert (ended.returncode, ended.stdout) == (code, f"{shown}\n"), ended.stderr


def test_a_script_that_a_setup_py_names_must_exist(workspace: Workspace) -> None:
    text = "from setuptools import setup\nsetup(scripts=['bin/gone'])\n"
    workspace.add("p", "catkin_python_setup()", setup_dot_py=text)
    workspace.add("q")
    result = workspace.build(installs=True)
    assert result.errors == [
        f"p: {workspace.base}/src/p/bin/gone does not exist; setup.py lists it in scripts"
    ]
    assert result.built == ["q"]


@pytest.mark.parametrize(("definition", "dependencies", "complaint"), [
    ("nope/X x\n", "nope", "p/msg/A.msg:1: there is no message type [nope/X]"),
    ("int32 a\n\nB b\n", "", "p/msg/A.msg:3: there is no message type [p/B]"),
    ("sensor_msgs/Image i\n", "", "generate_messages(DEPENDENCIES sensor_msgs)?"),
    ("int32\n", "", "p/msg/A.msg:1:"), ("Header h\nstd_msgs/String s\nduration d\n", "", ""),
    ("sensor_msgs/Image i\n", "sensor_msgs", ""),
])  # fmt: skip
def test_interfaces_are_checked(
    workspace: Workspace, definition: str, dependencies: str, complaint: str
) -> None:
    workspace.add(
        "p",
        f"{FIND}add_message_files(FILES A.msg)\ngenerate_messages(DEPENDENCIES {dependencies})",
        msg__A_dot_msg=definition,
    )
    errors = workspace.build().errors
    assert len(errors) == bool(complaint)
    assert all(complaint in error for error in errors)


@pytest.mark.parametrize(
    ("depends", "named", "is_good"), [("rospy", "rospy", True), ("std_msgs", "rospy", False), ("", "", True)]
)
def test_run_dependencies_must_be_in_the_manifest(
    workspace: Workspace, depends: str, named: str, is_good: bool
) -> None:
    folder = workspace.add("p", f"catkin_package(CATKIN_DEPENDS {named})", depends)
    errors = workspace.build().errors
    assert is_good is (errors == [])
    if errors:
        assert f"{folder / 'CMakeLists.txt'}:3" in errors[0]
        assert "Add <exec_depend>rospy</exec_depend>" in errors[0]


def test_types_of_all_kinds_are_looked_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", "")
    assert "String" in MESSAGES.names("std_msgs")
    assert MESSAGES.types_named("Pose2D") == ["geometry_msgs/Pose2D"]
    assert MESSAGES.types_named("a/B") == ["a/B"]
    assert {"std_msgs", "nav_msgs"} <= set(MESSAGES.packages())
    assert SERVICES.text("std_srvs/SetBool", is_raw=False) == "bool data\n---\nbool success\nstring message\n"
    assert SERVICES.md5("std_srvs/Empty") == "d41d8cd98f00b204e9800998ecf8427e"
    assert MESSAGES.md5("std_msgs/String") == "992ce8a1687cec8c8bd883ec73ca41d1"
    assert ACTIONS.names("actionlib_tutorials")
    lookup = MESSAGES.definitions.message
    assert expanded(lookup("geometry_msgs/Pose2D"), lookup) == "float64 x\nfloat64 y\nfloat64 theta\n"


def test_stubs_in_the_workspace_follow_its_definitions(workspace: Workspace) -> None:
    folder = workspace.add(
        "p",
        f"{FIND}catkin_python_setup()\nadd_message_files(FILES A.msg)\ngenerate_messages()",
        msg__A_dot_msg="int32 number\n",
        setup_dot_py="from setuptools import setup\nsetup(packages=['p'], package_dir={'': 'src'})\n",
        src__p__words_dot_py="",
    )
    (folder / "src/p/__init__.py").touch()
    assert workspace.build().errors == []
    assert not (workspace.base / "typings").exists()  # `pipros stubs` creates it

    (workspace.base / "typings").mkdir()
    assert workspace.build().errors == []
    assert "number: int" in (workspace.base / "typings/p/msg/__init__.pyi").read_text()
    (folder / "msg" / "A.msg").write_text("string name\n")
    assert workspace.build().errors == []
    assert "name: str" in (workspace.base / "typings/p/msg/__init__.pyi").read_text()
    assert not (workspace.base / "typings/p/__init__.pyi").exists()  # which would hide p.words
