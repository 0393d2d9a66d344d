"""The contents of an installation: every import package, every command, and the import hook."""

import ast
import importlib
import importlib.metadata
import importlib.util
import os
import re
import shutil
import stat
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from pipros_tools.cli.entry_point import command
from tests.support.environments import REPOSITORY, ROOTS, SHIPPED, files_below, project_files
from tests.support.left_out import libraries
from tests.support.project import PLUGIN_PROJECTS, PROJECT
from tests.support.project import PROGRAMS as COMMANDS
from tests.support.windows_here import EXTRAS, TEST_TOOLS


def test_every_folder_of_sources_is_installed_and_checked_for_types() -> None:
    found = {
        top: {str(each.relative_to(REPOSITORY)) for each in REPOSITORY.glob(f"{top}/*/[sf][ra]c*")}
        for top in ("packages", "plugins")
    }
    assert set(PROJECT["tool"]["mypy"]["mypy_path"].split(":")) == found["packages"] | found["plugins"]
    targets = {"": PROJECT["tool"]["hatch"]["build"]}
    targets |= {f"plugins/{name}/": each["tool"]["hatch"]["build"] for name, each in PLUGIN_PROJECTS.items()}
    for place, build in targets.items():
        wheel = build["targets"]["wheel"]
        here = {f"{place}{each}" for each in wheel["only-include"]}
        assert here == {each for each in found["plugins" if place else "packages"] if each.startswith(place)}
        assert wheel["sources"] == wheel["only-include"]
        has_tests = (
            ["."]
            if place
            else sorted(str(each.relative_to(REPOSITORY)) for each in REPOSITORY.glob("packages/pipros*"))
        )
        assert build["dev-mode-dirs"] == [*wheel["sources"], *has_tests]


PACKAGES = [file.parent for folder in ROOTS for file in folder.glob("*/__init__.py")]


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.name)
def test_type_checkers_take_the_types_of_every_package(package: Path) -> None:
    assert (package / "py.typed").is_file()


def required(requirements: Sequence[Any]) -> Iterator[str]:
    """Yield the names of distributions that requirements, groups and extras of this tree name."""
    for each in requirements:
        if isinstance(each, dict):
            yield from required(PROJECT["dependency-groups"][each["include-group"]])
        elif match := re.match(r"([\w.-]+)(?:\[([\w,]+)\])?", each):
            yield match[1].replace("_", "-")
            project = PLUGIN_PROJECTS.get(match[1], PROJECT)["project"]
            for extra in match[2].split(",") if match[1].startswith("pipros") and match[2] else ():
                yield from required(project["optional-dependencies"][extra])


@pytest.mark.parametrize(
    "folder",
    sorted(
        f"{each.parent.name}/{each.name}"
        for each in (*REPOSITORY.glob("packages/*"), *REPOSITORY.glob("plugins/*"))
    ),
)
def test_a_package_requires_the_libraries_that_its_tests_name(folder: str) -> None:
    """Otherwise `script/test NAME` leaves such tests out; see tests.support.left_out."""
    here = REPOSITORY / folder
    if here.name in PLUGIN_PROJECTS:
        plugin = PLUGIN_PROJECTS[here.name]
        own = [*plugin["project"]["dependencies"], *plugin["dependency-groups"]["test"]]
    else:
        own = PROJECT["dependency-groups"][here.name.removeprefix("pipros-")]
    known = {*required(own)}
    named = {name for file in (here / "tests").rglob("test_*.py") for name in libraries(file)}
    owners = importlib.metadata.packages_distributions()
    assert [
        name for name in sorted(named) if not known & {each.replace("_", "-") for each in owners[name]}
    ] == []


def test_windows_gets_the_tools_of_tests_in_versions_that_are_required_elsewhere() -> None:
    assert {*TEST_TOOLS} <= {str(each) for group in PROJECT["dependency-groups"].values() for each in group}
    assert {*EXTRAS.split(",")} <= {*PROJECT["project"]["optional-dependencies"]}


def is_started_by_the_frame(main: object) -> bool:
    """Return True if `main` was decorated with `pipros_tools.cli.entry_point.command`."""
    return getattr(main, "__code__", None) is command(lambda: 0).__code__


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_a_decorated_main(name: str) -> None:
    module, _, function = COMMANDS[name].partition(":")

    main = getattr(importlib.import_module(module), function)
    while not is_started_by_the_frame(main) and hasattr(main, "__wrapped__"):
        main = main.__wrapped__  # a facade's, around that of a command
    assert is_started_by_the_frame(main), "@command is missing"


def test_the_version_is_defined_once() -> None:
    import pipros

    assert PROJECT["project"]["version"] == pipros.__version__ == importlib.metadata.version("pipros")


def test_every_interpreter_of_the_environment_has_the_import_hook() -> None:
    asked = "import sys; print('pipros.startup' in sys.modules)"

    ended = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)

    assert ended.stdout == "True\n"


def build_wheel(folder: Path, source: Path = REPOSITORY) -> Path:
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder], cwd=source, check=True,
        capture_output=True,
    )  # fmt: skip
    (wheel,) = folder.glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_wheel(tmp_path_factory.mktemp("wheel"))


def copy_for_owner(source: str, target: str) -> None:
    """Copy a file as a checkout with umask 077 would write it, with the present time."""
    shutil.copyfile(source, target)
    os.chmod(target, os.stat(source).st_mode & 0o700)


def test_builds_in_other_folders_times_and_umasks_are_the_same_bytes(wheel: Path, tmp_path: Path) -> None:
    source = tmp_path / "checkout"
    source.mkdir(0o700)
    for name in ("packages", "plugins", "script"):
        leave_out = shutil.ignore_patterns("__pycache__")
        shutil.copytree(REPOSITORY / name, source / name, ignore=leave_out, copy_function=copy_for_owner)
    for file in REPOSITORY.glob("*.*"):
        if file.is_file():
            copy_for_owner(str(file), str(source / file.name))
    copy_for_owner(str(REPOSITORY / "LICENSE"), str(source / "LICENSE"))
    assert build_wheel(tmp_path, source).read_bytes() == wheel.read_bytes()


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git")
def test_the_source_archive_has_all_files_of_the_repository(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path)]
    subprocess.run(build, cwd=REPOSITORY, check=True, capture_output=True)
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as opened:
        packed = {name.partition("/")[2] for name in opened.getnames()}

    tracked = [file.relative_to(REPOSITORY).as_posix() for file in project_files() if file.exists()]
    tracked = [name for name in tracked if not name.startswith("plugins/")]  # these have their own archives

    assert [name for name in tracked if name not in packed] == []


def test_the_newest_release_of_the_changelog_is_this_version() -> None:
    text = (REPOSITORY / "CHANGELOG.md").read_text()

    found = re.search(r"^## \[(\d[\d.]*)\] - \d{4}-\d\d-\d\d$", text, re.MULTILINE)

    assert found
    assert found[1] == PROJECT["project"]["version"]


def test_each_change_in_the_newest_section_of_the_changelog_is_one_short_line() -> None:
    newest = (REPOSITORY / "CHANGELOG.md").read_text().split("\n## [")[1]

    lines = [line for line in newest.splitlines()[1:] if line and not line.startswith("### ")]
    assert [line for line in lines if not line.startswith("- ") or len(line) > 220] == []


def test_the_wheel_is_small_and_has_executable_programs_and_stubs(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        assert sum(file.file_size for file in archive.infolist()) < 15e6
        assert {
            "pipros/etc/ros/python_logging.conf", "pipros/share/ros/README",
            "pipros/share/turtlesim/launch/multisim.launch", "pipros/share/pipros_sim/maps/room.pgm",
            "pipros_simulation/robots/page/index.html", "pipros_simulation/turtlesim/page/index.html",
            "pipros_server/sliders/page/index.html", "pipros/share/teleop_twist_joy/config/ps3.config.yaml",
            "sensor_msgs/point_cloud2.py", "std_msgs/msg/__init__.pyi",
            f"pipros-{PROJECT['project']['version']}.dist-info/licenses/THIRD_PARTY.md",
        } <= set(archive.namelist())  # fmt: skip
        programs = {
            file.filename: stat.S_IMODE(file.external_attr >> 16)
            for file in archive.infolist()
            if file.filename.startswith("pipros/share/rostest/nodes/")
        }
    assert (len(programs), set(programs.values())) == (5, {0o755})


PROGRAMS = {
    str(path.relative_to(share)): path.read_text(encoding="utf-8")
    for share in SHIPPED
    for path in files_below(share)
    if path.is_file() and os.access(path, os.X_OK) and path.suffix in ("", ".py")
}


def test_programs_of_packages_import_what_exists() -> None:
    assert len(PROGRAMS) > 80
    imports = {
        (node.module, alias.name)
        for text in PROGRAMS.values()
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.ImportFrom) and re.match(r"pipros(_\w+)?[.]", node.module or "")
        for alias in node.names
    }
    missing = []
    for module, name in sorted(imports, key=str):
        try:
            found = hasattr(importlib.import_module(str(module)), name)
        except ModuleNotFoundError:
            found = False
        if not found:
            missing.append((module, name))
    assert missing == []


def test_programs_of_packages_end_quietly_when_a_pipe_is_closed() -> None:
    """Each program is a command of pipros or is started like one; the test nodes print little."""
    for_students = re.compile(
        r"(rospy|actionlib)_tutorials/|turtle_\w+/"
    )  # they show what a student would write
    others = {
        name
        for name, text in PROGRAMS.items()
        if not re.search(r"from pipros_(tools\.cli|\w+\.commands)", text) and not for_students.match(name)
    }
    assert others == {
        "roswtf/scripts/roswtf",  # the facade's main is that of a command
        "rosunit/scripts/test_results_dir.py",
        *(f"rostest/nodes/{name}test" for name in ("advertise", "hz", "param", "publish", "subscribe")),
    }
