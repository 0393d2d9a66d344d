"""Packages like those in public repositories. `tests.interop` builds them with genuine catkin."""

import shutil
from collections.abc import Sequence
from pathlib import Path

import pytest

from pipros.packages import SHARE, shipped_folder
from pipros_workspace import genuine_catkin, native_tools
from pipros_workspace.catkin.context import FoundPackage
from pipros_workspace.catkin.project import Project
from pipros_workspace.catkin.project_reader import read_project
from pipros_workspace.cmake.language import CMakeError
from pipros_workspace.layout import SourcePackage
from pipros_workspace.python2 import python2_advice
from tests.support.debian_packages import FOUND_BY_CMAKE
from tests.support.environments import SOURCES, files_below
from tests.support.workspaces import Workspace, hide_setuptools

SETUP = "from setuptools import setup\nsetup(packages=['p'], package_dir={'': 'src'})\n"
MESSAGES = "add_message_files(FILES A.msg)\ngenerate_messages()\n"
CFG = """from dynamic_reconfigure.parameter_generator_catkin import ParameterGenerator, int_t

gen = ParameterGenerator()
gen.add("size", int_t, 0, "Size", 1)
exit(gen.generate("cfg", "cfg", "P"))
"""


@pytest.fixture
def workspace(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> Workspace:
    hide_setuptools(tmp_path_factory.mktemp("path"), monkeypatch)
    return Workspace(tmp_path)


@pytest.mark.parametrize("cmake", [
    "find_package(catkin REQUIRED)\ncatkin_python_setup()\ncatkin_package()",
    "find_package(catkin REQUIRED)\ncatkin_package()\ncatkin_python_setup()",
    "find_package(catkin REQUIRED message_generation)\ncatkin_python_setup()\n"
    f"{MESSAGES}catkin_package()",
])  # fmt: skip
def test_python_setup_may_come_anywhere_before_messages(workspace: Workspace, cmake: str) -> None:
    workspace.add("p", cmake, msg__A_dot_msg="int32 a\n", setup_dot_py=SETUP, src__p__a_dot_py="")
    assert workspace.build().errors == []
    assert (workspace.layout.devel / "lib/python3/dist-packages/p/__init__.py").is_file()


@pytest.mark.parametrize(("cmake", "complaint"), [
    (
        f"find_package(catkin REQUIRED message_generation)\n{MESSAGES}catkin_python_setup()",
        "generate_messages() must be called after catkin_python_setup()",
    ),
    (
        "find_package(catkin REQUIRED dynamic_reconfigure)\n"
        "generate_dynamic_reconfigure_options(cfg/P.cfg)\ncatkin_python_setup()",
        "generate_dynamic_reconfigure_options() must be called after catkin_python_setup()",
    ),
    ("find_package(catkin REQUIRED)\ncatkin_python_setup(p)", "called with unused arguments: p"),
    ("find_package(catkin rospy)", 'invalid argument "rospy"'),
    ("find_package(catkin REQUIRED QUIET rospy)", 'invalid argument "rospy"'),
])  # fmt: skip
def test_packages_refused_by_catkin_are_refused(workspace: Workspace, cmake: str, complaint: str) -> None:
    workspace.add("p", cmake, msg__A_dot_msg="int32 a\n", setup_dot_py=SETUP)
    (error,) = workspace.build().errors
    assert complaint in error


@pytest.mark.parametrize(("arguments", "found"), [
    ("REQUIRED rospy std_msgs", "1 1"), ("REQUIRED COMPONENTS rospy std_msgs", "1 1"),
    ("COMPONENTS rospy REQUIRED std_msgs", "1 1"),
    ("0.5 EXACT REQUIRED COMPONENTS rospy OPTIONAL_COMPONENTS std_msgs", "1 1"),
    ("0.5...<2.0 REQUIRED rospy NO_MODULE", "1 "), ("QUIET COMPONENTS rospy nope", "1 "), ("REQUIRED", " "),
])  # fmt: skip
def test_components_are_found_wherever_they_are_named(
    workspace: Workspace, arguments: str, found: str
) -> None:
    workspace.add(
        "p", f'find_package(catkin {arguments})\nmessage(STATUS "found ${{rospy_FOUND}} ${{std_msgs_FOUND}}")'
    )
    assert workspace.build().errors == []
    assert f"-- found {found}" in workspace.lines


def test_versions_of_what_was_found_are_known(workspace: Workspace) -> None:
    workspace.add("a")
    workspace.add(
        "p",
        "find_package(catkin REQUIRED a std_msgs)\nfind_package(nav_msgs REQUIRED)\n"
        'message(STATUS "v ${a_VERSION} ${std_msgs_VERSION} ${nav_msgs_VERSION} ${catkin_VERSION}")',
        "a",
    )
    assert workspace.build().errors == []
    assert "-- v 0.1.0 0.5.13 1.13.1 0.8.10" in workspace.lines


@pytest.mark.parametrize(
    ("environment", "printed"), [({}, "noetic 1 3"), ({"ROS_DISTRO": "one", "ROS_VERSION": "1"}, "one 1 3")]
)
def test_the_distribution_is_in_the_environment(
    workspace: Workspace, environment: dict[str, str], printed: str
) -> None:
    workspace.add("p", 'message(STATUS "ros $ENV{ROS_DISTRO} $ENV{ROS_VERSION} $ENV{ROS_PYTHON_VERSION}")')
    workspace.build(environment)
    assert f"-- ros {printed}" in workspace.lines


def test_messages_may_be_in_folders_below(workspace: Workspace) -> None:
    workspace.add(
        "p",
        "find_package(catkin REQUIRED message_generation)\n"
        "add_message_files(FILES deep/below/A.msg)\nadd_message_files(DIRECTORY msg/more FILES B.msg)\n"
        "add_message_files(DIRECTORY msg/own FILES C.msg NOINSTALL)\ngenerate_messages()\ncatkin_package()",
        msg__deep__below__A_dot_msg="int32 a\n",
        msg__more__B_dot_msg="A a\n",
        msg__own__C_dot_msg="p/B b\n",
    )
    assert workspace.build(installs=True).errors == []
    share = workspace.layout.install / "share" / "p"
    assert {str(path.relative_to(share)) for path in share.rglob("*.msg")} == {"msg/A.msg", "msg/more/B.msg"}


@pytest.mark.parametrize(("dependencies", "errors"), [
    ("nav_msgs", 0), ("user_of_geometry", 0), ("std_srvs", 1), ("no_such_package", 1)
])  # fmt: skip
def test_a_message_dependency_brings_its_own_dependencies(
    workspace: Workspace, dependencies: str, errors: int
) -> None:
    workspace.add("user_of_geometry", depends="geometry_msgs")
    workspace.add(
        "p",
        "find_package(catkin REQUIRED message_generation)\nadd_message_files(FILES A.msg)\n"
        f"generate_messages(DEPENDENCIES {dependencies})",
        "user_of_geometry",
        msg__A_dot_msg="geometry_msgs/Pose p\n",
    )
    assert len(workspace.build().errors) == errors


def test_without_genuine_catkin_dependencies_of_compiled_code_are_built(workspace: Workspace) -> None:
    workspace.add(
        "messages",
        f"find_package(catkin REQUIRED message_generation)\n{MESSAGES}",
        msg__A_dot_msg="int32 a\n",
    )
    workspace.add("cpp", "add_executable(x x.cpp)", "messages")

    result = workspace.build()

    assert [error.partition(":")[0] for error in result.errors] == ["cpp"]
    assert (workspace.layout.devel / "lib/python3/dist-packages/messages/__init__.py").is_file()


def test_cfg_files_without_dynamic_reconfigure_do_not_fail_the_rest(
    workspace: Workspace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools = native_tools.NativeTools("/usr/bin/cmake", tmp_path / "opt")
    built: list[str] = []

    def build(_tools: object, packages: Sequence[SourcePackage], *_: object) -> dict[str, str]:
        built.extend(package.name for package in packages)
        return {}

    monkeypatch.setattr(native_tools, "find_tools", lambda *_: tools)
    monkeypatch.setattr(genuine_catkin, "build", build)
    workspace.add("cpp", "add_executable(x x.cpp)")
    cfg = "find_package(catkin REQUIRED dynamic_reconfigure)\ngenerate_dynamic_reconfigure_options(cfg/P.cfg)"
    cfg += "\nadd_executable(y y.cpp)"
    folder = workspace.add("cfg", cfg, "dynamic_reconfigure", cfg__P_dot_cfg=CFG)
    workspace.add("user", depends="cfg")
    workspace.add("cpp_user", "add_executable(z z.cpp)", "cfg")

    result = workspace.build()

    assert built == ["cpp"]
    (error,) = result.errors
    assert f"{folder / 'CMakeLists.txt'}:5: the package [cfg] " in error
    assert "and has `.cfg` files, but" in error
    assert "genuine dynamic_reconfigure is not installed" in error
    assert (result.skipped, set(result.built)) == ({"cpp_user": "cfg"}, {"cpp", "user"})

    config = tmp_path / "opt/lib/x86_64-linux-gnu/cmake/dynamic_reconfigure/dynamic_reconfigureConfig.cmake"
    config.parent.mkdir(parents=True)
    config.touch()
    built.clear()
    assert workspace.build().errors == []
    assert set(built) >= {"cpp", "cfg", "cpp_user"}


def test_packages_may_use_actions_and_parameters_of_packages_in_their_workspace(workspace: Workspace) -> None:
    for name in ("actionlib_msgs", "dynamic_reconfigure"):
        # as genuine packages, which define their commands in CMake files
        extras = (
            "macro(add_action_files)\nmessage(FATAL_ERROR actions)\nendmacro()\n"
            "macro(generate_dynamic_reconfigure_options)\nmessage(FATAL_ERROR parameters)\nendmacro()\n"
        )
        cmake = f"find_package(catkin REQUIRED)\ncatkin_package(CFG_EXTRAS {name}-extras.cmake)"
        folder = workspace.add(name, cmake, **{f"cmake__{name}-extras_dot_cmake": extras})
        for kind in ("msg", "srv"):
            if Path(SHARE, name, kind).is_dir():
                shutil.copytree(Path(SHARE, name, kind), folder / kind)
    workspace.add(
        "p",
        "find_package(catkin REQUIRED COMPONENTS actionlib_msgs dynamic_reconfigure message_generation)\n"
        "add_action_files(FILES Go.action)\ngenerate_messages(DEPENDENCIES actionlib_msgs std_msgs)\n"
        "generate_dynamic_reconfigure_options(cfg/P.cfg)\ncatkin_package()",
        "actionlib_msgs dynamic_reconfigure std_msgs",
        action__Go_dot_action="---\n---\n",
        cfg__P_dot_cfg=CFG,
    )
    result = workspace.build()
    assert (result.errors, result.built) == ([], ["actionlib_msgs", "dynamic_reconfigure", "p"])
    assert "Generating Python from ACTION p/Go" in workspace.lines
    assert "Generating dynamic reconfigure files from cfg/P.cfg" in "\n".join(workspace.lines)


# The properties of a package that `read_project` finds in its `CMakeLists.txt`, without a build.


FILES = (
    "msg/A.msg", "msg/B.msg", "srv/S.srv", "action/D.action", "test/x.test", "test/test_it.py",
    "launch/x.launch",
    "scripts/a.py", "include/p/x.h", "env-hooks/10.p.sh", "cmake/p.cmake",
)  # fmt: skip
FIND = "find_package(catkin REQUIRED message_generation rostest roslaunch)\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "p"
    for file in FILES:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).touch()
    return folder


def read(folder: Path, text: str, packages: dict[str, FoundPackage] | None = None) -> Project:
    (folder / "CMakeLists.txt").write_text(text)
    known = {"rospy": FoundPackage("1.15.15"), **(packages or {})}
    return read_project(str(folder), "p", {}, {}, lambda name: known.get(name), "1.2.3")


@pytest.mark.parametrize("name", [*FOUND_BY_CMAKE, "rqt_gui_py"])
def test_every_ros_package_that_cmake_finds_on_debian_is_found(folder: Path, name: str) -> None:
    shipped = {name: FoundPackage()} if shipped_folder(name) else {}

    project = read(folder, f"find_package(catkin REQUIRED COMPONENTS {name})\ncatkin_package()", shipped)

    assert ([component for component, _ in project.components], project.needs_cmake) == ([name], [])


@pytest.mark.parametrize(("text", "interfaces"), [
    ("add_message_files(FILES A.msg B.msg)", ["msg A msg", "msg B msg"]),
    ("add_message_files()", ["msg A msg", "msg B msg"]),
    ("add_message_files(DIRECTORY msg FILES B.msg NOINSTALL)", ["msg B None"]),
    ("add_service_files(FILES S.srv)\nadd_message_files(FILES A.msg)", ["srv S srv", "msg A msg"]),
    ("add_action_files(DIRECTORY action)", ["action D action"]),
    ("set(M A.msg)\nadd_message_files(FILES ${M} ${NOPE})", ["msg A msg"]),
])  # fmt: skip
def test_interfaces(folder: Path, text: str, interfaces: list[str]) -> None:
    found = read(folder, FIND + text).interfaces
    assert [f"{interface.kind} {interface.name} {interface.folder}" for interface in found] == interfaces
    assert all(Path(interface.path).is_file() for interface in found)


@pytest.mark.parametrize(("text", "tests"), [
    ("add_rostest(test/x.test)", [("rostest", "test/x.test", ())]),
    ("add_rostest(test/x.test ARGS a:=1 DEPENDENCIES d)", [("rostest", "test/x.test", ("a:=1",))]),
    ("catkin_add_nosetests(test)", [("python", "test", ())]),
    ("catkin_add_nosetests(test/test_it.py)", [("python", "test/test_it.py", ())]),
    (
        "roslaunch_add_file_check(launch a:=1 IGNORE_UNSET_ARGS)",
        [("roslaunch", "launch", ("-i", "a:=1"))],
    ),
    ("add_rostest_gtest(mine test/x.test x.cpp)", [("rostest", "test/x.test", ())]),
    ("catkin_add_gtest(mine x.cpp)", [("gtest", "", ())]),
    ("if(NOT CATKIN_ENABLE_TESTING)\nadd_rostest(test/x.test)\nendif()", []),
])  # fmt: skip
def test_tests(folder: Path, text: str, tests: list[tuple[str, str, tuple[str, ...]]]) -> None:
    found = read(folder, FIND + text).tests
    assert [(test.kind, test.written, test.arguments) for test in found] == tests
    assert all(test.place == f"{folder / 'CMakeLists.txt'}:2" for test in found)


@pytest.mark.parametrize(("text", "sources"), [
    ("install(FILES a b DESTINATION d)", ["a", "b"]), ("install(DIRECTORY launch DESTINATION d)", ["launch"]),
    ("catkin_install_python(PROGRAMS scripts/a.py DESTINATION d)", ["scripts/a.py"]),
    ("install(TARGETS x RUNTIME DESTINATION d)", []), ('install(CODE "message(x)")', [""]),
    ("install(SCRIPT cmake/p.cmake)", ["cmake/p.cmake"]),
])  # fmt: skip
def test_installations(folder: Path, text: str, sources: list[str]) -> None:
    found = read(folder, text).installations
    assert [item.source.removeprefix(f"{folder.as_posix()}/") for item in found] == sources
    assert all(item.is_python == text.startswith("catkin_install") for item in found)


@pytest.mark.parametrize(("text", "reason"), [
    ("add_executable(x x.cpp)", "compiles [x]"), ("add_library(y SHARED y.cpp)", "compiles [y]"),
    ("try_run(A B . x.cpp)", "needs try_run(), which only CMake itself can execute"),
    ("add_custom_target(t ALL COMMAND a | b)", "needs the shell that [a | b] needs"),
    ("add_custom_target(t COMMAND $<TARGET_FILE:x>)", "needs the generator expression $<TARGET_FILE:x>"),
    (
        "find_package(Foreign)\nforeign_command()",
        "needs foreign_command(), which another package provides",
    ),
])  # fmt: skip
def test_targets_that_need_genuine_catkin_are_found_with_their_line(
    folder: Path, text: str, reason: str
) -> None:
    project = read(folder, text)
    (target,) = project.needs_cmake
    assert target.what.startswith(reason)
    assert (target.file, target.line) == (project.file, text.count("\n") + 1)


@pytest.mark.parametrize("text", [
    "include_directories(${catkin_INCLUDE_DIRS})\nadd_definitions(-DX)",
    "set_target_properties(x PROPERTIES A b)", "add_library(headers INTERFACE)", "add_library(x ALIAS y)",
    "find_package(catkin REQUIRED COMPONENTS nodelet)\nclass_loader_hide_library_symbols(x)",
    "find_package(Boost REQUIRED)\nfind_package(Python3)", "enable_testing()\ninclude(CTest)",
])  # fmt: skip
def test_commands_for_compilers_have_no_effect(folder: Path, text: str) -> None:
    assert read(folder, text).needs_cmake == []


@pytest.mark.parametrize(("text", "complaint", "line"), [
    ("project(other)", "The project is named [other], but package.xml names the package [p]", 1),
    ("add_message_files(FILES A.msg)", "It comes with message_generation", 1),
    (FIND + "add_message_files(FILES Nope.msg)", "was given a file that does not exist", 2),
    (FIND + "catkin_package()\ngenerate_messages()", "must be called before catkin_package()", 3),
    ("catkin_package(INCLUDE_DIRS nope)", "include dir 'nope' does not exist", 1),
    ("catkin_package(CFG_EXTRAS nope.cmake)", "could not find CFG_EXTRAS file", 1),
    ("catkin_python_setup()", "called without 'setup.py'", 1),
    ("catkin_add_env_hooks(99.nope SHELLS sh)", "could not find environment hook", 1),
    ("catkin_install_python(PROGRAMS nope.py DESTINATION d)", "cannot find the script", 1),
    ("install(FILES a)", "given no DESTINATION", 1), ("add_rostest(test/x.test)", "It comes with rostest", 1),
    (FIND + "add_rostest(nope.test)", "was given a file that does not exist", 2),
    ("\nadd_mesage_files()", "Did you mean add_message_files?", 2),
    ('message(FATAL_ERROR "a reason")', "a reason", 1),
])  # fmt: skip
def test_mistakes_have_their_line(folder: Path, text: str, complaint: str, line: int) -> None:
    with pytest.raises(CMakeError) as error:
        read(folder, text)
    assert complaint in str(error.value)
    assert f"{folder / 'CMakeLists.txt'}:{line} " in str(error.value)


def test_packages_give_their_extras_to_those_that_find_them(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "plain.cmake").write_text("set(FROM_PLAIN 1)\nfunction(own_command)\nendfunction()\n")
    (tmp_path / "made.cmake").write_text("set(FROM_MADE ${PROJECT_NAME})\n")
    packages = {
        "helper": FoundPackage("3.2.1", [str(tmp_path / "plain.cmake"), str(tmp_path / "made.cmake")])
    }
    project = read(
        folder,
        "project(p)\nfind_package(catkin REQUIRED helper)\nown_command()\n"
        'message(STATUS "${FROM_PLAIN} ${FROM_MADE} ${helper_VERSION}")',
        packages,
    )
    assert project.status_lines == ["-- 1 p 3.2.1"]


def test_messages_are_sorted_by_their_modes(folder: Path) -> None:
    project = read(
        folder,
        'message(STATUS "a" b)\nmessage("plain")\nmessage(WARNING "w")\nmessage(DEBUG "d")\n'
        'message(DEPRECATION "x")',
    )
    assert project.status_lines == ["-- ab", "plain"]
    assert project.warnings == [f"{folder / 'CMakeLists.txt'}:3: w", f"{folder / 'CMakeLists.txt'}:5: x"]


def test_output_before_an_error_is_kept(folder: Path) -> None:
    lines: list[str] = []
    (folder / "CMakeLists.txt").write_text('message(STATUS "so far")\nnonsense()')
    with pytest.raises(CMakeError):
        read_project(str(folder), "p", {}, {}, status_lines=lines)
    assert lines == ["-- so far"]


def test_hooks_and_extras_are_found_in_their_folders(folder: Path) -> None:
    (folder / "env-hooks" / "20.p.bash.in").write_text("export X=@PROJECT_NAME@\n")
    (folder / "cmake" / "q.cmake.in").touch()
    project = read(
        folder,
        "project(p)\ncatkin_add_env_hooks(10.p SHELLS sh)\ncatkin_add_env_hooks(20.p SHELLS bash)\n"
        "catkin_package(CFG_EXTRAS p.cmake q.cmake CATKIN_DEPENDS rospy)",
    )
    assert [(hook.name, hook.text) for hook in project.hooks] == [
        ("10.p.sh", None),
        ("20.p.bash", "export X=p\n"),
    ]
    assert [Path(path).name for path in project.cfg_extras] == ["p.cmake", "q.cmake"]
    assert project.catkin_depends == [("rospy", 4)]


def test_the_manifest_and_genmsg_set_variables(folder: Path) -> None:
    text = (
        "find_package(catkin REQUIRED COMPONENTS genmsg)\ncatkin_package_xml()\n"
        "install(FILES ${p_VERSION} DESTINATION ${GENMSG_LANGS_DESTINATION})"
    )

    (item,) = read(folder, text, {"genmsg": FoundPackage()}).installations

    assert item.copy is not None
    assert (item.copy.source, item.copy.target) == (f"{folder}/1.2.3", "etc/ros/genmsg")


# Scripts for Python 2 are recognised, with advice that converts them; scripts for Python 3 never are.


TABS = "def f():\n    if True:\n\treturn 1\n        return 2\n"


@pytest.mark.parametrize("text", [
    "print 'hello'\n", 'import rospy\nprint "x = %d" % 3\n',
    "import sys\nprint >>sys.stderr, 1\nprint 1\n",
    "try:\n    f()\nexcept ValueError, error:\n    pass\n", "raise ValueError, 'x'\n",
    "if 1 <> 2: pass\n", "x = `1`\n", "import os\nos.chmod('x', 0755)\n",
])  # fmt: skip
def test_python_2_is_recognised(tmp_path: Path, text: str) -> None:
    script = tmp_path / "script.py"
    script.write_text(text)
    advice = python2_advice(script)
    assert advice is not None
    assert "is Python 2" in advice
    assert f"python -m fissix -w {script}" in advice
    assert "expand" not in advice


def test_a_script_of_a_devel_space_stands_for_the_one_that_it_runs(tmp_path: Path) -> None:
    script, relay = tmp_path / "src" / "script.py", tmp_path / "devel" / "script.py"
    for file, text in ((script, "print 'x'\n"), (relay, f"script = {str(script)!r}\n")):
        file.parent.mkdir()
        file.write_text(text)
    assert f"{script}:1 is Python 2" in (python2_advice(relay) or "")


def test_tabs_are_converted_first(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(TABS)
    assert "mixes tabs and spaces" in (python2_advice(script) or "")
    script.write_text(TABS + "print 'x'\n")
    advice = python2_advice(script) or ""
    assert advice.index("expand -t 8") < advice.index("fissix")


@pytest.mark.parametrize("text", ["print('x')\n", "print ('x')\n", "def f(:\n", "x = '<>'\n", "\tprint(1)\n"])
def test_python_3_gets_no_advice(tmp_path: Path, text: str) -> None:
    script = tmp_path / "script.py"
    script.write_text(text)
    assert python2_advice(script) is None


def test_no_script_of_this_tree_gets_advice() -> None:
    scripts = [file for folder in SOURCES for file in files_below(folder, "*.py")]
    assert len(scripts) > 500
    assert [file for file in scripts if python2_advice(file)] == []
