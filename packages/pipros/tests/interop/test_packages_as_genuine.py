"""A package with all features that need no compiler, built by genuine catkin and by pipros.

The install spaces contain the same files with the same modes and contents, the tests write results of the
same names, and the setup files run the same hooks.
"""

import stat
from pathlib import Path

import pytest

from tests.support.catkin import CATKIN
from tests.support.once import machine_folder, make_once
from tests.support.ros import RosSystem, Side

CMAKE = """\
cmake_minimum_required(VERSION 3.0.2)
project(everything)
find_package(catkin REQUIRED COMPONENTS rospy std_msgs message_generation roslaunch)
catkin_python_setup()
add_message_files(FILES A.msg)
add_service_files(DIRECTORY srv FILES B.srv)
generate_messages(DEPENDENCIES std_msgs)
catkin_package(CATKIN_DEPENDS rospy message_runtime)

function(install_all kind)
  cmake_parse_arguments(ALL "" "TO" "FROM" ${ARGN})
  foreach(folder IN LISTS ALL_FROM)
    file(GLOB found RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} ${folder}/*.${kind})
    list(FILTER found EXCLUDE REGEX "secret")
    install(FILES ${found} DESTINATION ${ALL_TO})
  endforeach()
endfunction()
install_all(yaml FROM config more TO ${CATKIN_PACKAGE_SHARE_DESTINATION}/yaml)

catkin_install_python(PROGRAMS scripts/a.py scripts/b DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
install(PROGRAMS scripts/c.sh DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION} RENAME see)
install(DIRECTORY launch DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION} PATTERN "*.swp" EXCLUDE)
install(DIRECTORY config/ DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}/c FILES_MATCHING PATTERN "*.yaml"
  PATTERN "old" EXCLUDE)
install(DIRECTORY scripts/ DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}/s USE_SOURCE_PERMISSIONS)

set(VALUE "of the package ${PROJECT_NAME} ${everything_VERSION}")
configure_file(config/x.in generated/x.txt @ONLY)
add_custom_command(OUTPUT generated/y.txt
  COMMAND ${CMAKE_COMMAND} -E copy ${CMAKE_CURRENT_BINARY_DIR}/generated/x.txt generated/y.txt
  DEPENDS ${CMAKE_CURRENT_BINARY_DIR}/generated/x.txt)
add_custom_target(generated_files ALL DEPENDS generated/y.txt)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/generated/x.txt ${CMAKE_CURRENT_BINARY_DIR}/generated/y.txt
  DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(CODE "file(WRITE \\${CMAKE_INSTALL_PREFIX}/share/everything/code.txt \\"${PROJECT_NAME}\\\\n\\")")
catkin_add_env_hooks(50.everything SHELLS sh bash zsh DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/env-hooks)

if(CATKIN_ENABLE_TESTING)
  find_package(rostest REQUIRED)
  add_rostest(test/x.test)
  add_rostest(test/x.test ARGS a:=1 b:=two/three)
  add_rostest(test/x.test ARGS a:=0.5)
  catkin_add_nosetests(test)
  catkin_add_nosetests(test/sub/test_it.py)
  catkin_add_nosetests(${CMAKE_CURRENT_SOURCE_DIR}/test/sub/)
  roslaunch_add_file_check(launch)
  roslaunch_add_file_check(launch/x.launch a:=1 b:=2)
  roslaunch_add_file_check(launch/x.launch IGNORE_UNSET_ARGS)
endif()
"""

FILES = {
    "CMakeLists.txt": CMAKE,
    "package.xml": '<package format="2"><name>everything</name><version>1.2.3</version>'
    '<description>d</description><maintainer email="a@example.org">A</maintainer><license>BSD</license>'
    "<buildtool_depend>catkin</buildtool_depend><depend>rospy</depend><depend>std_msgs</depend>"
    "<depend>roslaunch</depend><build_depend>message_generation</build_depend>"
    "<exec_depend>message_runtime</exec_depend><test_depend>rostest</test_depend></package>",
    "setup.py": "from setuptools import setup\n"
    "from catkin_pkg.python_setup import generate_distutils_setup\n"
    "setup(**generate_distutils_setup(packages=['everything'], package_dir={'': 'src'}))\n",
    "src/everything/__init__.py": "",
    "src/everything/words.py": "WORD = 1\n",
    "msg/A.msg": "std_msgs/String a\n",
    "srv/B.srv": "---\n",
    "scripts/a.py": "#!/usr/bin/env python\nprint('a')\n",
    "scripts/b": "#!/usr/bin/env python3\nprint('b')\n",
    "scripts/c.sh": "#!/bin/sh\n",
    "launch/x.launch": '<launch><arg name="a" default="0"/><arg name="b" default="0"/></launch>\n',
    "launch/.hidden": "h\n",
    "launch/x.swp": "s\n",
    "config/a.yaml": "a: 1\n",
    "config/secret.yaml": "a: 1\n",
    "config/x.in": "@VALUE@ ${VALUE} @NOPE@\n",
    "config/old/b.yaml": "b\n",
    "config/sub/c.yaml": "c\n",
    "config/sub/d.txt": "d\n",
    "more/m.yaml": "m\n",
    "test/x.test": '<launch><arg name="a" default="0"/><arg name="b" default="0"/></launch>\n',
    "test/sub/test_it.py": "def test_it():\n    pass\n",
    "env-hooks/50.everything.sh": 'export HOOKS="${HOOKS}, sh of $CATKIN_ENV_HOOK_WORKSPACE"\n',
    "env-hooks/50.everything.bash": 'export HOOKS="${HOOKS}, bash"\n',
    "env-hooks/50.everything.zsh.in": 'export HOOKS="${HOOKS}, zsh of @PROJECT_NAME@"\n',
}

GENERATED = (
    "cmake", "catkin_env_hook", "include", "common-lisp", "gennodejs", "roseus", "pkgconfig", "python3",
)  # fmt: skip
"""Folders whose contents are for C++ and Lisp, or are made when they are imported."""


def make_workspace(side: Side, base: Path) -> None:
    for name, content in FILES.items():
        file = base / "src" / "everything" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(content)
        file.chmod(0o755 if name.startswith("scripts/") else 0o644)
    side.environment.pop("ROS_PACKAGE_PATH", None)
    for target in ("install", "run_tests"):
        made = side.run("catkin_make", "-C", base, target, timeout_s=300)
        assert made.returncode == 0, made.output


def installed(base: Path) -> dict[str, tuple[str, bytes]]:
    """Return path, mode and content of the installed files."""
    install = base / "install"
    found = {}
    for path in install.rglob("*"):
        below = path.relative_to(install)
        if path.is_file() and len(below.parts) > 1 and not set(GENERATED) & set(below.parts):
            found[str(below)] = (stat.filemode(path.stat().st_mode), path.read_bytes())
    return found


def results(base: Path) -> set[str]:
    """Return the names of the result files."""
    return {path.name for path in (base / "build/test_results").rglob("*.xml")}


@pytest.mark.timeout(900)
def test_a_package_is_built_and_installed_as_by_genuine_catkin(ros: RosSystem, tmp_path: Path) -> None:
    genuine, pipros = machine_folder("everything", (Path(__file__), CATKIN)), tmp_path / "pipros"
    make_once(genuine, lambda: make_workspace(ros.genuine, genuine))
    make_workspace(ros.pipros, pipros)
    assert installed(pipros) == installed(genuine)
    assert results(pipros) == results(genuine)
    modules = "lib/python3/dist-packages/everything"
    assert (pipros / "install" / modules / "words.py").read_bytes() == (
        genuine / "install" / modules / "words.py"
    ).read_bytes()
    for space in ("devel", "install"):
        for shell in ("sh", "bash", "zsh"):
            assert hooks(ros, pipros / space, shell) == hooks(ros, genuine / space, shell)


def hooks(ros: RosSystem, space: Path, shell: str) -> str:
    """Return the output of the hooks of a space that is sourced twice."""
    source = f". ./setup.{shell}"
    ended = ros.genuine.processes.run(
        shell, "-c", f'{source}; {source}; echo "$HOOKS"', cwd=space,
        environment={"CMAKE_PREFIX_PATH": "", "_CATKIN_SETUP_DIR": str(space) if shell == "sh" else ""},
    )  # fmt: skip
    assert ended.returncode == 0, ended.output
    return ended.stdout[-1].replace(str(space.parent), "WORKSPACE")
