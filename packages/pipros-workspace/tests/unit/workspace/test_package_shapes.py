"""Packages like those in public repositories. `tests.interop` builds them with genuine catkin."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

import pytest

from pipros.packages import SHARE
from pipros_workspace import genuine_catkin, native_tools
from pipros_workspace.layout import SourcePackage
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


@pytest.mark.parametrize(
    ("dependencies", "errors"),
    [("nav_msgs", 0), ("user_of_geometry", 0), ("std_srvs", 1), ("no_such_package", 1)],
)
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
