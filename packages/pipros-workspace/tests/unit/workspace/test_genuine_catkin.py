"""The packages that are passed to genuine catkin besides those of the workspace."""

from pathlib import Path

import pytest

from pipros_workspace import genuine_catkin
from pipros_workspace.build_options import BuildOptions
from pipros_workspace.cmake_runs import NativeBuildFailed
from pipros_workspace.genuine_catkin import use_python_of_environment
from pipros_workspace.index import SHARED_PACKAGES
from pipros_workspace.layout import SourcePackage, WorkspaceFolders, read_source_space
from pipros_workspace.native_tools import MissingTools, NativeTools, find_tools, has_tools, native_environment
from pipros_workspace.pkg_config import NoFlags, flags
from pipros_workspace.shipped_packages import shipped_packages
from tests.support.workspaces import Workspace

MANIFEST = """<package format="2"><name>arm</name><version>1.0.0</version><description>d</description>
<maintainer email="m@example.org">m</maintainer><license>none</license>
<depend>control_msgs</depend><depend>roscpp</depend><depend>no_such_package</depend></package>"""


def arm(source: Path) -> list[SourcePackage]:
    folder = source / "arm"
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(MANIFEST)
    return read_source_space(source, {}).packages


def prefix_with(folder: Path, *packages: str) -> Path:
    """A folder in which CMake finds packages, as below /opt/ros/noetic."""
    for package in packages:
        config = folder / "share" / package / "cmake" / f"{package}Config.cmake"
        config.parent.mkdir(parents=True)
        config.touch()
    return folder


def test_packages_that_genuine_ros_does_not_have_come_from_pipros_with_their_dependencies(
    tmp_path: Path,
) -> None:
    prefix = prefix_with(tmp_path / "opt", "std_msgs", "geometry_msgs", "trajectory_msgs")

    shipped = shipped_packages(arm(tmp_path / "src"), [tmp_path / "other", prefix])
    assert {package.name for package in shipped} == {"control_msgs", "actionlib_msgs"}
    assert all(package.folder == SHARED_PACKAGES / package.name for package in shipped)


def test_packages_of_genuine_ros_and_the_workspace_are_not_replaced(tmp_path: Path) -> None:
    packages = arm(tmp_path / "src")

    assert shipped_packages(packages, [prefix_with(tmp_path / "opt", "control_msgs")]) == []

    own = SourcePackage("control_msgs", tmp_path / "src" / "control_msgs", packages[0].manifest)
    assert shipped_packages([*packages, own], []) == []


@pytest.mark.parametrize("folder", ["share/control_msgs/cmake", "lib/cmake/control_msgs",
                                    "lib/aarch64-linux-gnu/cmake/control_msgs"])  # fmt: skip
def test_an_installed_package_is_found_wherever_cmake_finds_it(tmp_path: Path, folder: str) -> None:
    config = tmp_path / "usr" / folder / "control_msgsConfig.cmake"
    config.parent.mkdir(parents=True)
    config.touch()

    assert shipped_packages(arm(tmp_path / "src"), [tmp_path / "usr"]) == []


def programs(folder: Path, *names: str, code: int = 0) -> dict[str, str]:
    """Return an environment in which only these programs exist; they exit with `code`."""
    folder.mkdir()
    for name in names:
        file = folder / name
        file.write_text(f"#!/bin/sh\nexit {code}\n")
        file.chmod(0o755)
    return {"PATH": str(folder)}


@pytest.mark.parametrize(("names", "advice"), [
    ((), "apt install cmake make g++ catkin libroscpp-dev ros-message-generation"),
    (("cmake", "make"), "apt install make g++"), (("cmake", "c++"), "apt install make g++"),
    (("cmake", "make", "c++"), "apt install catkin libroscpp-dev ros-message-generation"),
])  # fmt: skip
def test_missing_tools_are_named_with_the_packages_to_install(
    tmp_path: Path, names: tuple[str, ...], advice: str
) -> None:
    environment = programs(tmp_path / "bin", *names)

    assert not has_tools(environment, prefixes=())
    with pytest.raises(MissingTools) as error:
        find_tools(environment, prefixes=())
    assert advice in str(error.value)


def test_the_tools_of_an_overlay_are_found_by_its_prefix(tmp_path: Path) -> None:
    environment = programs(tmp_path / "bin", "cmake", "make", "c++")
    toplevel = tmp_path / "opt" / "share" / "catkin" / "cmake" / "toplevel.cmake"
    toplevel.parent.mkdir(parents=True)
    toplevel.touch()
    environment["CMAKE_PREFIX_PATH"] = f"{tmp_path / 'opt'}"

    tools = find_tools(environment)

    assert (tools.prefix, tools.toplevel) == (tmp_path / "opt", toplevel)


@pytest.mark.needs("first lines")
def test_a_tool_that_fails_is_named(tmp_path: Path) -> None:
    programs(tmp_path / "bin", "cmake", code=3)
    layout = WorkspaceFolders(tmp_path, *(tmp_path / name for name in ("src", "build", "devel", "install")))
    tools = NativeTools(str(tmp_path / "bin" / "cmake"), tmp_path / "opt")

    with pytest.raises(NativeBuildFailed, match=r"cmake .* failed; the reason is printed above"):
        genuine_catkin.build(tools, arm(tmp_path / "src"), layout, BuildOptions(), lambda _line: None, {}, {})


@pytest.mark.needs("first lines")
def test_the_workspace_itself_is_not_an_underlay_of_its_compiled_packages(tmp_path: Path) -> None:
    layout = WorkspaceFolders(tmp_path, *(tmp_path / name for name in ("src", "build", "devel", "install")))
    cmake = tmp_path / "cmake"
    cmake.write_text(f"#!/bin/sh\necho $CMAKE_PREFIX_PATH >'{tmp_path}/prefixes'\nexit 3\n")
    cmake.chmod(0o755)
    sourced = {"CMAKE_PREFIX_PATH": f"{layout.devel}:{layout.install}:{tmp_path}/other"}

    with pytest.raises(NativeBuildFailed):
        genuine_catkin.build(
            NativeTools(str(cmake), tmp_path / "opt"), arm(layout.source), layout, BuildOptions(),
            lambda _line: None, sourced, {},
        )  # fmt: skip

    first, *rest = (tmp_path / "prefixes").read_text().strip().split(":")
    assert first == f"{tmp_path}/other"
    assert not {str(layout.devel), str(layout.install)} & set(rest)


def test_a_package_below_the_prefix_path_is_found_by_packages_without_compiled_code(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    workspace.add("p", "find_package(catkin REQUIRED COMPONENTS of_a_prefix)\ncatkin_package()")
    prefix = prefix_with(tmp_path / "opt", "of_a_prefix")

    assert workspace.build({"CMAKE_PREFIX_PATH": str(prefix)}).errors == []

    assert workspace.build({"CMAKE_PREFIX_PATH": str(prefix)}).projects["p"].absent == []
    (absent,) = workspace.build({"CMAKE_PREFIX_PATH": ""}).projects["p"].absent
    assert 'provided by "of_a_prefix"' in absent.error


PYTHON_PACKAGES = ("robot_state_publisher", "xacro", "joint_state_publisher", "diagnostic_updater", "angles",
                   "rqt_graph", "cv_bridge", "image_geometry", "interactive_markers", "rospy")  # fmt: skip


@pytest.mark.needs("first lines")
@pytest.mark.parametrize("name", PYTHON_PACKAGES)
def test_a_python_package_of_pipros_is_found_by_cmake_and_not_built(tmp_path: Path, name: str) -> None:
    """Genuine catkin would require its CMakeLists.txt."""
    folder, layout = programs_and_layout(tmp_path)
    add_manifest(tmp_path / "src", f"<exec_depend>{name}</exec_depend>")
    packages = read_source_space(tmp_path / "src", {}).packages
    lines: list[str] = []

    genuine_catkin.build(folder, packages, layout, BuildOptions(), lines.append, {"PATH": "/bin"}, {})

    native = tmp_path / "build" / "pipros" / "native"
    assert sorted(path.name for path in (native / "src").iterdir()) == ["CMakeLists.txt", "arm"]
    configuration = native / "provided" / "share" / name / "cmake" / f"{name}Config.cmake"
    assert f"set({name}_FOUND_CATKIN_PROJECT TRUE)" in configuration.read_text()
    assert (tmp_path / "prefix_path").read_text().strip() == f"{tmp_path / 'opt'}:{native / 'provided'}"
    assert not any("is not installed" in line for line in lines)


def test_a_python_package_that_is_installed_is_left_to_cmake(tmp_path: Path) -> None:
    add_manifest(tmp_path / "src", "<exec_depend>xacro</exec_depend>")
    packages = read_source_space(tmp_path / "src", {}).packages

    assert shipped_packages(packages, [prefix_with(tmp_path / "opt", "xacro")]) == []


@pytest.mark.needs("first lines")
def test_packages_found_without_a_declared_dependency_are_found_too(tmp_path: Path) -> None:
    folder, layout = programs_and_layout(tmp_path)
    add_manifest(tmp_path / "src", "")
    packages = read_source_space(tmp_path / "src", {}).packages
    lines: list[str] = []

    genuine_catkin.build(
        folder, packages, layout, BuildOptions(), lines.append, {"PATH": "/bin"}, {"arm": ["tf2_ros"]}
    )

    assert "-- tf2_ros is not installed: CMake finds the one from pipros, which has no C++" in lines


@pytest.mark.parametrize("name", ["message_generation", "message_runtime", "rostest", "dynamic_reconfigure"])
def test_only_the_genuine_package_provides_cmake_commands(tmp_path: Path, name: str) -> None:
    add_manifest(tmp_path / "src", f"<depend>{name}</depend>")
    packages = read_source_space(tmp_path / "src", {}).packages

    assert name not in {package.name for package in shipped_packages(packages, []) if not has_cmake(package)}


@pytest.mark.parametrize(
    ("prefix", "distribution"), [("/usr", "Debian"), ("/opt/ros/noetic", "noetic"), ("/opt/ros/one", "one")]
)
def test_genuine_catkin_gets_the_environment_of_its_own_distribution(prefix: str, distribution: str) -> None:
    """A hook of Debian's packages complains about another one, and its output would end the build."""
    sourced = {
        "ROS_DISTRO": "noetic", "ROS_ROOT": "/p/ros", "ROS_ETC_DIR": "/p/etc", "VIRTUAL_ENV": "/v", "A": "b",
    }  # fmt: skip

    variables = native_environment(NativeTools("/usr/bin/cmake", Path(prefix)), sourced)

    assert variables["ROS_DISTRO"] == distribution
    assert (variables["ROS_VERSION"], variables["ROS_PYTHON_VERSION"]) == ("1", "3")
    assert not variables.keys() & {"ROS_ROOT", "ROS_ETC_DIR", "VIRTUAL_ENV"}
    assert variables["A"] == "b"


def test_programs_of_genuine_catkin_run_on_the_python_of_the_environment(tmp_path: Path) -> None:
    texts = {
        "lib/p/node.py": b"#!/usr/bin/python3\npass\n",
        "bin/tool": b"#!/usr/bin/python3\n",
        "lib/p/other": b"#!/usr/bin/python3.9\n",
        "lib/p/compiled": b"\x7fELF\n",
        "lib/p/empty": b"",
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(text)
        (tmp_path / name).chmod(0o755)
    (tmp_path / "lib" / "p" / "link").symlink_to("/usr/bin/python3")

    use_python_of_environment(tmp_path)
    use_python_of_environment(tmp_path / "nowhere")

    changed = {"lib/p/node.py": b"#!/usr/bin/env python3\npass\n", "bin/tool": b"#!/usr/bin/env python3\n"}
    assert {name: (tmp_path / name).read_bytes() for name in texts} == texts | changed
    assert (tmp_path / "bin" / "tool").stat().st_mode & 0o777 == 0o755


def add_manifest(source: Path, dependencies: str) -> None:
    folder = source / "arm"
    folder.mkdir(parents=True)
    begin, _, _ = MANIFEST.partition("<depend>")
    (folder / "package.xml").write_text(f"{begin}{dependencies}</package>")


def has_cmake(package: SourcePackage) -> bool:
    return (package.folder / "CMakeLists.txt").is_file()


def programs_and_layout(tmp_path: Path) -> tuple[NativeTools, WorkspaceFolders]:
    """Fake tools, of which `cmake` writes its prefix path to a file, and the spaces of a workspace."""
    layout = WorkspaceFolders(tmp_path, *(tmp_path / name for name in ("src", "build", "devel", "install")))
    programs(tmp_path / "bin", "cmake")
    (tmp_path / "bin" / "cmake").write_text(f"#!/bin/sh\necho $CMAKE_PREFIX_PATH > {tmp_path}/prefix_path\n")
    (tmp_path / "opt" / "bin").mkdir(parents=True)
    (tmp_path / "opt" / "bin" / "make").symlink_to("/bin/true")
    return NativeTools(str(tmp_path / "bin" / "cmake"), tmp_path / "opt"), layout


def test_catkin_tools_in_the_environment_of_pipros_print_instructions() -> None:
    """CMake code of genuine catkin imports this function from the `catkin` of the environment."""
    from catkin.environment_cache import generate_environment_script

    with pytest.raises(SystemExit, match="catkin build --cmake-args -DPYTHON_EXECUTABLE=/usr/bin/python3"):
        generate_environment_script("/ws/devel/env.sh")


def pkg_config(folder: Path, monkeypatch: pytest.MonkeyPatch, answer: str, code: int = 0) -> None:
    """A program of that name with this output, the only one in PATH."""
    folder.mkdir()
    stream = ">&2" if code else ""
    (folder / "pkg-config").write_text(f"#!/bin/sh\nprintf '%s\\n' '{answer}' {stream}\nexit {code}\n")
    (folder / "pkg-config").chmod(0o755)
    monkeypatch.setenv("PATH", str(folder))


@pytest.mark.needs("first lines")
def test_folders_of_overlays_come_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    prefixes = [tmp_path / "upper", tmp_path / "lower"]
    for prefix in prefixes:
        prefix.mkdir()
        (prefix / ".catkin").touch()
    monkeypatch.setenv("CMAKE_PREFIX_PATH", ":".join(map(str, prefixes)))
    folders = ["/usr/include", f"{prefixes[1]}/include", f"{prefixes[0]}/include", f"{prefixes[0]}2/include"]
    pkg_config(tmp_path / "bin", monkeypatch, " ".join(f"-I{folder}" for folder in folders))
    assert flags("p", "cflags-only-I", "-I") == [folders[2], folders[1], folders[0], folders[3]]


@pytest.mark.needs("first lines")
def test_other_flags_keep_their_order_and_prefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pkg_config(tmp_path / "bin", monkeypatch, "-pthread -DX=1  -DA")
    assert flags("p", "cflags-only-other") == ["-pthread", "-DX=1", "-DA"]


@pytest.mark.needs("first lines")
def test_a_failed_query_names_the_query_and_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pkg_config(tmp_path / "bin", monkeypatch, "Package p was not found.", code=1)
    with pytest.raises(NoFlags, match=r"'pkg-config --libs-only-l p' failed: Package p was not found\."):
        flags("p", "libs-only-l", "-l")
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(NoFlags, match="pkg-config is not installed"):
        flags("p", "libs-only-l", "-l")
