"""catkin_find, catkin_topological_order and catkin_make_isolated compared with the genuine ones."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pipros_workspace.index import SHIPPED_FOLDERS
from tests.support.answers import ask
from tests.support.ros import RosSystem, Side

MANIFEST = """\
<package format="2"><name>{name}</name><version>0.1.0</version><description>d</description>
<maintainer email="a@example.org">A</maintainer><license>BSD</license>
<buildtool_depend>catkin</buildtool_depend>{depends}</package>
"""
CMAKE = """\
cmake_minimum_required(VERSION 3.0.2)
project({name})
find_package(catkin REQUIRED)
catkin_package()
catkin_python_setup()
"""
SETUP = """\
from setuptools import setup
setup(name='{name}', version='0.1.0', packages=['{name}'], package_dir={{'': 'src'}})
"""


def write_package(source: Path, name: str, depends: str = "", cmake: str = "") -> Path:
    folder = source / name
    modules = folder / "src" / name
    modules.mkdir(parents=True)
    (modules / "__init__.py").write_text(f"NAME = {name!r}\n")
    (folder / "setup.py").write_text(SETUP.format(name=name))
    text = "".join(f"<depend>{other}</depend>" for other in depends.split())
    (folder / "package.xml").write_text(MANIFEST.format(name=name, depends=text))
    (folder / "CMakeLists.txt").write_text(CMAKE.format(name=name) + cmake)
    return folder


def write_plain_package(source: Path, name: str) -> None:
    """A package that CMake builds without catkin, and whose configuration it installs."""
    folder = source / name
    folder.mkdir()
    export = "<export><build_type>cmake</build_type></export>"
    (folder / "package.xml").write_text(MANIFEST.format(name=name, depends=export))
    (folder / f"{name}Config.cmake").touch()
    install = f"install(FILES {name}Config.cmake DESTINATION share/{name}/cmake)\n"
    head = f"cmake_minimum_required(VERSION 3.0.2)\nproject({name} NONE)\n"
    (folder / "CMakeLists.txt").write_text(head + install)


@pytest.fixture
def spaces(tmp_path: Path) -> Path:
    """A devel space `upper` with a source folder, above an install space `lower`."""
    write_package(tmp_path / "src", "b")
    write_package(tmp_path / "src", "a", "b")
    for folder in ("upper/lib/b", "upper/share/b", "lower/share/b/launch", "lower/share/c", "lower/lib/b",
                   "lower/etc/b", "lower/include/b", "lower/bin", "lower/libexec/b"):  # fmt: skip
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "lower/share/b/launch/x.launch").touch()
    (tmp_path / "lower/.catkin").touch()
    (tmp_path / "upper/.catkin").write_text(str(tmp_path / "src"))
    return tmp_path


FINDS = [
    "", "b", "a", "c", "nope", "b launch/x.launch", "b launch", "a package.xml", "b package.xml",
    "a src/a/__init__.py", "b --share", "b --lib", "b --libexec", "b --bin", "b --etc --include", "--share",
    "--libexec", "--bin --lib",
    "b --first-only", "nope --first-only", "b --without-underlays", "b launch --without-underlays",
    "a src --first-only", "b launch --first-only --share", "--frobnicate", "a b c",
]  # fmt: skip


@pytest.mark.parametrize("words", FINDS)
def test_catkin_find_prints_the_same(ros: RosSystem, spaces: Path, words: str) -> None:
    path = os.pathsep.join(str(spaces / name) for name in ("upper", "lower", "nowhere"))
    answers = []
    for side in (ros.pipros, ros.genuine):
        ended = ask(side, "catkin_find", *words.split(), CMAKE_PREFIX_PATH=path)
        # Each side has an additional workspace: the packages included in pipros, or Debian's packages.
        other = (*(str(each.parent) for each in SHIPPED_FOLDERS), "/usr", "/etc")
        printed = [line for line in ended.stdout if not line.startswith(other)]
        errors = [line for line in ended.stderr if not line.startswith(other)]
        answers.append((ended.returncode, printed, errors if ended.returncode == 1 else []))
    assert answers[0] == answers[1]


@pytest.mark.parametrize(
    "words",
    ["src", "src --only-names", "src --only-folders", "src --only-names --only-folders", "nowhere", "empty",
     ". --only-names", "src/a --underlay-workspaces src/b", "circle", "broken"],
)  # fmt: skip
def test_the_topological_order_is_the_same(ros: RosSystem, spaces: Path, words: str) -> None:
    (spaces / "empty").mkdir()
    write_package(spaces / "circle", "x", "y")
    write_package(spaces / "circle", "y", "x")
    (spaces / "broken" / "z").mkdir(parents=True)
    (spaces / "broken" / "z" / "package.xml").write_text("<package")
    for folder in ("circle", "broken"):
        (spaces / folder / "CATKIN_IGNORE").touch(exist_ok=True) if words not in (folder,) else None
    answers = []
    for side in (ros.pipros, ros.genuine):
        ended = ask(side, "catkin_topological_order", *words.split(), cwd=spaces)
        complaint = ended.stderr if ended.returncode in (1, 3) and words != "broken" else []
        answers.append((ended.returncode, ended.stdout, complaint))
    assert answers[0] == answers[1]


ENDS = [
    "-C nowhere", "-C empty", "--source nowhere", "--pkg nope", "--from-pkg nope", "--only-pkg-with-deps a",
    "--merge --only-pkg-with-deps nope", "--pkg a --from-pkg b", "--frobnicate",
]  # fmt: skip


@pytest.mark.parametrize("words", ENDS)
def test_wrong_command_lines_of_catkin_make_isolated_end_alike(
    ros: RosSystem, spaces: Path, words: str
) -> None:
    (spaces / "empty").mkdir()
    ends = []
    for side in (ros.pipros, ros.genuine):
        ended = side.processes.run("catkin_make_isolated", *words.split(), cwd=spaces, timeout_s=60)
        ends.append((ended.returncode, ended.stderr[-1:] if ended.returncode == 1 else []))
    assert ends[0] == ends[1]


def built(side: Side, base: Path, *words: str) -> tuple[int | None, list[str], list[str], list[str]]:
    """Return exit code and headlines, and the workspaces and modules of a shell that sourced the result."""
    side.environment.pop("ROS_PACKAGE_PATH", None)
    made = side.processes.run("catkin_make_isolated", *words, cwd=base, timeout_s=240)
    headlines = [line for line in made.stdout if line.startswith(("~~", "==> Proc", "<== "))]
    devel = base / "devel_isolated"
    listing = (
        "echo $CMAKE_PREFIX_PATH; echo $ROS_PACKAGE_PATH; python3 -c 'import a, b; print(a.NAME, b.NAME)'"
    )
    shown = side.processes.run("bash", "-c", f". {devel}/setup.bash; {listing}", cwd=base)
    below = [entry for line in shown.stdout[:2] for entry in line.split(os.pathsep) if str(base) in entry]
    return made.returncode, headlines, [entry.replace(str(base), "") for entry in below], shown.stdout[2:]


@pytest.mark.timeout(300)
@pytest.mark.parametrize("words", ["", "--merge --install -q"])
def test_an_isolated_workspace_is_set_up_alike(ros: RosSystem, tmp_path: Path, words: str) -> None:
    outcomes = []
    for name, side in (("pipros", ros.pipros), ("genuine", ros.genuine)):
        write_package(tmp_path / name / "src", "b")
        write_package(tmp_path / name / "src", "a", "b")
        outcomes.append(built(side, tmp_path / name, *words.split()))
    assert outcomes[0] == outcomes[1]


@pytest.mark.timeout(300)
def test_packages_with_compiled_code_are_built_by_genuine_catkin_with_what_they_need(
    ros: RosSystem, tmp_path: Path
) -> None:
    write_package(tmp_path / "src", "b")
    write_plain_package(tmp_path / "src", "plain")
    cmake = "find_package(b REQUIRED)\nfind_package(plain REQUIRED)\nadd_executable(tool tool.cpp)\n"
    write_package(tmp_path / "src", "c", "b plain", cmake)
    (tmp_path / "src" / "c" / "tool.cpp").write_text("int main() { return 0; }\n")
    write_package(tmp_path / "src", "d", "c")
    ros.pipros.environment.pop("ROS_PACKAGE_PATH", None)
    path = {"PATH": f"{ros.pipros.environment['PATH']}:/usr/bin:/bin"}
    made = ros.pipros.processes.run("catkin_make_isolated", cwd=tmp_path, timeout_s=240, environment=path)
    assert made.returncode == 0, made.output
    assert "==> The package 'c' needs CMake: genuine catkin builds it and its dependencies" in made.stdout
    devel = tmp_path / "devel_isolated"
    assert os.access(devel / "c" / "lib" / "c" / "tool", os.X_OK)
    configurations = sorted(file.name for file in devel.glob("*/share/*/cmake/*Config.cmake"))
    assert configurations == ["bConfig.cmake", "cConfig.cmake", "plainConfig.cmake"]
    shown = ros.pipros.processes.run(
        "bash", "-c", f". {devel}/setup.bash; echo $ROS_DISTRO; rosrun c tool", cwd=tmp_path
    )
    assert (shown.stdout, shown.returncode) == (["noetic"], 0)
