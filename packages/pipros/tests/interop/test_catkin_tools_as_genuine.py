"""catkin's tools have the exit codes, output, files and error texts of the genuine ones."""

import os
import re
from pathlib import Path

import pytest

from pipros_workspace.index import SHIPPED_FOLDERS
from tests.support.ros import RosSystem, Side

MANIFEST = """\
<package format="2"><name>{name}</name><version>0.1.0</version><description>d</description>
<maintainer email="a@example.org">A</maintainer><license>BSD</license>
<buildtool_depend>catkin</buildtool_depend></package>
"""

CMAKE = """\
cmake_minimum_required(VERSION 3.0.2)
project(one)
find_package(catkin REQUIRED)
catkin_package()
"""

CREATE = [
    "a", "a rospy roscpp std_msgs", "a roscpp", "a --meta", "a -V 1.2.3 -D text -l MIT -a Ada -a Bob -m Carl",
    "a --boost-comps system thread", "a -s boost eigen", "a message_generation std_msgs", "a-b_c", "Bad-Name",
    "a rospy rospy", "a --rosdistro melodic", "", "a --nope", "a -V", "a -V bad", "a/b", "a a",
]  # fmt: skip

# Folder and command line; later ones use the files of earlier ones.
IN_A_WORKSPACE = [
    (".", "catkin_make"), (".", "catkin_make -j 4 VERBOSE=1 -k"), (".", "catkin_make --pkg nope"),
    (".", "catkin_make --only-pkg-with-deps nope other"), (".", "catkin_make -DCATKIN_WHITELIST_PACKAGES="),
    (".", "catkin_make -C nowhere"), ("src/one", "catkin_make"), (".", "catkin_make nonsense"),
    (".", "catkin_make one"), (".", "catkin_make tests run_tests"),
    (".", "catkin_make -DCATKIN_ENABLE_TESTING=0 run_tests"),
    (".", "catkin_make -DCATKIN_ENABLE_TESTING=1 clean_test_results"),
    (".", "catkin_make --source src --build other -DCATKIN_DEVEL_PREFIX=elsewhere install"),
    (".", "catkin_test_results"), (".", "catkin_test_results --all results"),
    (".", "catkin_test_results --verbose results"), (".", "catkin_test_results nowhere"),
    ("src", "catkin_init_workspace"), ("empty", "catkin_init_workspace"),
    (".", "catkin_init_workspace nowhere"),
]  # fmt: skip

RESULTS = {
    "a.xml": '<testsuite tests="3" errors="1" failures="1" skip="1"/>',
    "b.xml": '<testsuites><testsuite tests="2" errors="0" failures="0"/><testsuite tests="1"/></testsuites>',
    "c.xml": '<testsuites tests="1" errors="0" failures="0" disabled="2"/>',
    "d.xml": '<testsuite errors="1"/>', "e.xml": "<other/>",
}  # fmt: skip


def files_below(folder: Path) -> dict[str, str]:
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("words", CREATE)
def test_a_new_package_equals_that_of_genuine_catkin(ros: RosSystem, words: str, tmp_path: Path) -> None:
    made = []
    for name, side in (("genuine", ros.genuine), ("pipros", ros.pipros)):
        folder = tmp_path / name
        folder.mkdir()
        ended = side.run("catkin_create_pkg", *words.split(), cwd=folder, ROS_DISTRO="noetic", USER="ada")
        said = [line.replace(str(folder), "HERE") for line in ended.stdout]
        made.append((ended.returncode, said, files_below(folder)))
    assert made[1] == made[0]


def test_command_lines_end_as_they_do_in_genuine_catkin(ros: RosSystem, tmp_path: Path) -> None:
    assert carried_out(ros.pipros, tmp_path / "pipros") == carried_out(ros.genuine, tmp_path / "genuine")


def carried_out(side: Side, base: Path) -> list[tuple[str, int | None, list[str]]]:
    """Return each command line with its exit code and, if it failed, the error."""
    package = base / "src" / "one"
    for folder in (package, base / "empty", base / "results"):
        folder.mkdir(parents=True)
    (package / "package.xml").write_text(MANIFEST.format(name="one"))
    (package / "CMakeLists.txt").write_text(CMAKE)
    for name, content in RESULTS.items():
        (base / "results" / name).write_text(content)
    side.environment.pop("ROS_PACKAGE_PATH", None)
    ends = []
    for folder_name, line in IN_A_WORKSPACE:
        ended = side.run(*line.split(), cwd=base / folder_name, timeout_s=120)
        said = ended.stdout if "results" in line and "make" not in line else []
        if ended.returncode:
            said = [*said, *ended.stderr]
        ends.append((line, ended.returncode, sorted(filter(None, (plain(text, base) for text in said)))))
    return ends


def plain(line: str, base: Path) -> str:
    """Return a line without colours and paths; empty for lines of only one side, and for options of make."""
    line = re.sub(r"\033\[\d+m", "", line).replace(str(base), "BASE")
    line = re.sub(r'Invoking "make (.*?)( -[jl]\d+)* ?" failed', r'Invoking "make \1" failed', line)
    return "" if line.startswith("Call catkin_make in") else line


# catkin_find, catkin_topological_order and catkin_make_isolated compared with the genuine ones.
DEPENDING_MANIFEST = """\
<package format="2"><name>{name}</name><version>0.1.0</version><description>d</description>
<maintainer email="a@example.org">A</maintainer><license>BSD</license>
<buildtool_depend>catkin</buildtool_depend>{depends}</package>
"""
PYTHON_CMAKE = """\
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
    (folder / "package.xml").write_text(DEPENDING_MANIFEST.format(name=name, depends=text))
    (folder / "CMakeLists.txt").write_text(PYTHON_CMAKE.format(name=name) + cmake)
    return folder


def write_plain_package(source: Path, name: str) -> None:
    """A package that CMake builds without catkin, and whose configuration it installs."""
    folder = source / name
    folder.mkdir()
    export = "<export><build_type>cmake</build_type></export>"
    (folder / "package.xml").write_text(DEPENDING_MANIFEST.format(name=name, depends=export))
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
        ended = side.run("catkin_find", *words.split(), CMAKE_PREFIX_PATH=path)
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
        ended = side.run("catkin_topological_order", *words.split(), cwd=spaces)
        complaint = ended.stderr if ended.returncode in (1, 3) and words != "broken" else []
        answers.append((ended.returncode, ended.stdout, complaint))
    assert answers[0] == answers[1]


ENDS = [
    "-C nowhere", "-C empty", "--source nowhere", "--pkg nope", "--from-pkg nope", "--only-pkg-with-deps a",
    "--merge --only-pkg-with-deps nope", "--pkg a --from-pkg b", "--frobnicate",
]  # fmt: skip


@pytest.mark.parametrize("words", ENDS)
def test_wrong_command_lines_of_catkin_make_isolated_end_alike(ros, spaces: Path, words: str) -> None:
    (spaces / "empty").mkdir()
    ends = []
    for side in (ros.pipros, ros.genuine):
        ended = side.run("catkin_make_isolated", *words.split(), cwd=spaces)
        ends.append((ended.returncode, ended.stderr[-1:] if ended.returncode == 1 else []))
    assert ends[0] == ends[1]


def built(side: Side, base: Path, *words: str) -> tuple[int | None, list[str], list[str], list[str]]:
    """Return exit code and headlines, and the workspaces and modules of a shell that sourced the result."""
    side.environment.pop("ROS_PACKAGE_PATH", None)
    made = side.run("catkin_make_isolated", *words, cwd=base, timeout_s=240)
    headlines = [line for line in made.stdout if line.startswith(("~~", "==> Proc", "<== "))]
    devel = base / "devel_isolated"
    listing = (
        "echo $CMAKE_PREFIX_PATH; echo $ROS_PACKAGE_PATH; python3 -c 'import a, b; print(a.NAME, b.NAME)'"
    )
    shown = side.run("bash", "-c", f". {devel}/setup.bash; {listing}", cwd=base)
    below = [entry for line in shown.stdout[:2] for entry in line.split(os.pathsep) if str(base) in entry]
    return made.returncode, headlines, [entry.replace(str(base), "") for entry in below], shown.stdout[2:]


@pytest.mark.parametrize("words", ["", "--merge --install -q"])
def test_an_isolated_workspace_is_set_up_alike(ros: RosSystem, tmp_path: Path, words: str) -> None:
    outcomes = []
    for name, side in (("pipros", ros.pipros), ("genuine", ros.genuine)):
        write_package(tmp_path / name / "src", "b")
        write_package(tmp_path / name / "src", "a", "b")
        outcomes.append(built(side, tmp_path / name, *words.split()))
    assert outcomes[0] == outcomes[1]


def test_packages_with_compiled_code_are_built_by_genuine_catkin_with_what_they_need(ros, tmp_path) -> None:
    write_package(tmp_path / "src", "b")
    write_plain_package(tmp_path / "src", "plain")
    cmake = "find_package(b REQUIRED)\nfind_package(plain REQUIRED)\nadd_executable(tool tool.cpp)\n"
    write_package(tmp_path / "src", "c", "b plain", cmake)
    (tmp_path / "src" / "c" / "tool.cpp").write_text("int main() { return 0; }\n")
    write_package(tmp_path / "src", "d", "c")
    ros.pipros.environment.pop("ROS_PACKAGE_PATH", None)
    path = {"PATH": f"{ros.pipros.environment['PATH']}:/usr/bin:/bin"}
    made = ros.pipros.run("catkin_make_isolated", cwd=tmp_path, timeout_s=240, **path)
    assert made.returncode == 0, made.output
    assert "==> The package 'c' needs CMake: genuine catkin builds it and its dependencies" in made.stdout
    devel = tmp_path / "devel_isolated"
    assert os.access(devel / "c" / "lib" / "c" / "tool", os.X_OK)
    configurations = sorted(file.name for file in devel.glob("*/share/*/cmake/*Config.cmake"))
    assert configurations == ["bConfig.cmake", "cConfig.cmake", "plainConfig.cmake"]
    shown = ros.pipros.run(
        "bash", "-c", f". {devel}/setup.bash; echo $ROS_DISTRO; rosrun c tool", cwd=tmp_path
    )
    assert (shown.stdout, shown.returncode) == (["noetic"], 0)
