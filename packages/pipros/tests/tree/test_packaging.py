"""The contents of an installation: every import package, every command, and the import hook."""

from __future__ import annotations

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
from pathlib import Path

import pytest

from pipros.cli.entry_point import command
from tests.support.environments import FACADES, REPOSITORY, SRC, files_below
from tests.support.project import PROGRAMS as COMMANDS
from tests.support.project import PROJECT, load_toml


def test_every_package_has_a_project_and_is_checked_for_types() -> None:
    for folder in REPOSITORY.glob("packages/pipros*"):
        project = load_toml(folder / "pyproject.toml")
        assert project["project"]["name"] == folder.name
        hook = project["tool"]["hatch"]["metadata"]["hooks"]["custom"]
        assert hook == {"path": "../../script/metadata_hook.py"}
    folders = {str(file.relative_to(REPOSITORY)) for file in REPOSITORY.glob("packages/*/[sf][ra]c*")}
    assert folders <= set(PROJECT["tool"]["mypy"]["mypy_path"].split(":"))


PACKAGES = [file.parent for folder in (SRC, *FACADES) for file in folder.glob("*/__init__.py")]


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.name)
def test_type_checkers_take_the_types_of_every_package(package: Path) -> None:
    assert (package / "py.typed").is_file()
    assert PROJECT["tool"]["mypy"]["files"] == ["packages/*/src/pipros", "packages/*/facades"]


def is_started_by_the_frame(main: object) -> bool:
    """Return True if `main` was decorated with `pipros.cli.entry_point.command`."""
    return getattr(main, "__code__", None) is command(lambda: 0).__code__


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_a_decorated_main(name: str) -> None:
    module, _, function = COMMANDS[name].partition(":")

    main = getattr(importlib.import_module(module), function)
    while not is_started_by_the_frame(main) and hasattr(main, "__wrapped__"):
        main = main.__wrapped__  # a facade's, around that of a command
    assert is_started_by_the_frame(main), "@command is missing"


def test_a_main_without_the_decorator_is_found() -> None:
    assert not is_started_by_the_frame(lambda: 0)


def test_the_version_is_defined_once() -> None:
    import pipros

    assert PROJECT["project"]["version"] == pipros.__version__ == importlib.metadata.version("pipros")


def test_every_interpreter_of_the_environment_has_the_import_hook() -> None:
    asked = "import sys; print('pipros.startup' in sys.modules)"

    ended = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)

    assert ended.stdout == "True\n"


def build_wheel(folder: Path, source: Path = REPOSITORY) -> Path:
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder],
        cwd=source,
        check=True,
        capture_output=True,
    )
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
    for name in ("packages", "script"):
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

    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=REPOSITORY, check=True, capture_output=True, text=True
    )
    tracked = [name for name in listed.stdout.split("\0") if name and (REPOSITORY / name).exists()]

    assert [name for name in tracked if name not in packed] == []


def test_the_newest_release_of_the_changelog_is_this_version() -> None:
    text = (REPOSITORY / "CHANGELOG.md").read_text()

    found = re.search(r"^## \[(\d[\d.]*)\] - \d{4}-\d\d-\d\d$", text, re.MULTILINE)

    assert found
    assert found[1] == PROJECT["project"]["version"]


def test_the_newest_section_of_the_changelog_has_at_most_sixty_lines() -> None:
    newest = (REPOSITORY / "CHANGELOG.md").read_text().split("\n## [")[1]

    assert newest.count("\n") <= 60


def test_the_wheel_is_small_and_has_executable_programs_and_stubs(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        assert sum(file.file_size for file in archive.infolist()) < 15e6
        assert {
            "pipros/etc/ros/python_logging.conf",
            "pipros/share/ros/README",
            "pipros/share/turtlesim/launch/multisim.launch",
            "pipros/share/pipros_sim/maps/room.pgm",
            "pipros/simulation/robots/page/index.html",
            "pipros/simulation/turtlesim/page/index.html",
            "pipros/server/sliders/page/index.html",
            "pipros/share/teleop_twist_joy/config/ps3.config.yaml",
            "sensor_msgs-stubs/point_cloud2.pyi",
            f"pipros-{PROJECT['project']['version']}.dist-info/licenses/THIRD_PARTY.md",
        } <= set(archive.namelist())
        programs = {
            file.filename: stat.S_IMODE(file.external_attr >> 16)
            for file in archive.infolist()
            if file.filename.startswith("pipros/share/rostest/nodes/")
        }
    assert len(programs) == 5
    assert set(programs.values()) == {0o755}


SHARE = SRC / "pipros/share"
PROGRAMS = {
    str(path.relative_to(SHARE)): path.read_text(encoding="utf-8")
    for path in files_below(SHARE)
    if path.is_file() and os.access(path, os.X_OK) and path.suffix in ("", ".py")
}


def test_programs_of_packages_import_what_exists() -> None:
    assert len(PROGRAMS) > 80
    imports = {
        (node.module, alias.name)
        for text in PROGRAMS.values()
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "pipros"
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
        if not re.search(r"from pipros\.(cli|\w+\.commands)", text) and not for_students.match(name)
    }
    assert others == {
        "roswtf/scripts/roswtf",  # the facade's main is that of a command
        "rosunit/scripts/test_results_dir.py",
        *(f"rostest/nodes/{name}test" for name in ("advertise", "hz", "param", "publish", "subscribe")),
    }


def test_the_modules_that_programs_of_packages_import_exist() -> None:
    share = SRC / "pipros/share"
    texts = [path.read_text() for path in files_below(share) if os.access(path, os.X_OK)]
    modules = {
        name for text in texts for name in re.findall(r"^from (pipros[\w.]*) import", text, re.MULTILINE)
    }
    assert "pipros.cli.entry_point" in modules
    assert [name for name in sorted(modules) if importlib.util.find_spec(name) is None] == []
