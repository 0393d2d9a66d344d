"""Setup files of three workspaces, sourced in many orders, set the same variables as genuine ones."""

import re
from functools import partial
from pathlib import Path

import pytest

from tests.support.catkin import CATKIN
from tests.support.environments import genuine_environment, pipros_environment
from tests.support.once import machine_folder, make_once, shared_folder
from tests.support.processes import Processes

CMAKE = """\
cmake_minimum_required(VERSION 3.0.2)
project({name})
find_package(catkin REQUIRED)
catkin_python_setup()
catkin_package()
install(PROGRAMS tool DESTINATION bin)
"""
FILES = {
    "package.xml": '<package format="2"><name>{name}</name><version>0.1.0</version>'
    '<description>d</description><maintainer email="a@example.org">A</maintainer><license>BSD</license>'
    "<buildtool_depend>catkin</buildtool_depend></package>",
    "CMakeLists.txt": CMAKE,
    "setup.py": "from setuptools import setup\n"
    "from catkin_pkg.python_setup import generate_distutils_setup\n"
    "setup(**generate_distutils_setup(packages=['{name}'], package_dir={{'': 'src'}}))\n",
    "src/{name}/__init__.py": "",
    "tool": "#!/bin/sh\n",
}

# `under` is below `over`; `other` is independent. SETUP is the file for the shell.
SEQUENCES = [
    ". under/devel/SETUP", ". over/devel/SETUP", ". under/devel/SETUP; . under/devel/SETUP",
    ". under/devel/SETUP; . over/devel/SETUP", ". over/devel/SETUP; . under/devel/SETUP",
    ". under/devel/SETUP; . other/devel/SETUP", ". under/devel/SETUP; . other/devel/SETUP --extend",
    ". other/devel/SETUP; . over/devel/SETUP --extend",
    ". other/devel/SETUP --extend; . under/devel/SETUP --extend; . other/devel/SETUP --extend",
    ". over/devel/local_SETUP", ". under/devel/SETUP; . other/devel/local_SETUP",
    ". over/devel/SETUP; . other/devel/local_SETUP; . under/devel/SETUP",
    ". under/devel/SETUP; . other/devel/SETUP --local", ". under/install/SETUP",
    ". over/install/SETUP; . under/devel/SETUP --extend", "cd over/devel; . ./SETUP; . ./SETUP",
    "export CMAKE_PREFIX_PATH=/nowhere:/var PYTHONPATH=/mine LD_LIBRARY_PATH=/lib; . under/devel/SETUP",
    "export ROS_PACKAGE_PATH=/mine ROS_MASTER_URI=http://there:1; . under/devel/SETUP",
]  # fmt: skip

NAMES = (
    "CMAKE_PREFIX_PATH ROS_PACKAGE_PATH PYTHONPATH LD_LIBRARY_PATH PATH ROS_MASTER_URI ROS_VERSION "
    "ROS_PYTHON_VERSION"
)
SHOW = "; ".join(f'echo "{name}=${{{name}-unset}}"' for name in NAMES.split())


@pytest.fixture(scope="session")
def base(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    return shared_folder(tmp_path_factory, worker_id) / "overlays"


@pytest.fixture(scope="session")
def sides(base: Path, bare_tools: Path) -> dict[str, Processes]:
    """Programs of pipros and genuine ROS before a setup file is sourced; both have three workspaces."""
    uri = "http://127.0.0.1:1"
    kept = machine_folder("overlays", (Path(__file__), CATKIN))
    made = {}
    for name, folder, environment in (
        ("genuine", kept, genuine_environment(kept, uri)),
        ("pipros", base, pipros_environment(base, uri, bare_tools)),
    ):
        for variable in ("ROS_PACKAGE_PATH", "ROS_MASTER_URI"):
            del environment[variable]
        made[name] = Processes(environment, folder)
        make_once(folder, partial(build, made[name], folder))
    return made


def build(side: Processes, base: Path) -> None:
    for workspace in ("under", "over", "other"):
        for path, content in FILES.items():
            file = base / workspace / "src" / f"pkg_{workspace}" / path.format(name=f"pkg_{workspace}")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(content.format(name=f"pkg_{workspace}"))
            file.chmod(0o755)
    for script in (
        "cd under && catkin_make install", ". under/devel/setup.bash && cd over && catkin_make install",
        "cd other && catkin_make install",
    ):  # fmt: skip
        made = side.run("bash", "-c", script, timeout_s=200)
        assert made.returncode == 0, made.output


@pytest.mark.timeout(900)  # the first test of a worker builds, or waits until another has
@pytest.mark.parametrize("shell", ["bash", "zsh"])
@pytest.mark.parametrize("sequence", SEQUENCES)
def test_the_environment_is_that_of_genuine_setup_files(sides, base: Path, sequence: str, shell: str) -> None:
    script = f"{sequence.replace('SETUP', f'setup.{shell}')}; {SHOW}"
    assert environment(sides["pipros"], shell, script) == environment(sides["genuine"], shell, script)


def environment(side: Processes, shell: str, script: str) -> list[str]:
    """Return the variables without the folders of either implementation."""
    ended = side.run(shell, "-c", script)
    assert ended.returncode == 0, ended.output
    own = {"/usr/lib/python3/dist-packages", *side.environment["PATH"].split(":")}
    lines = []
    for line in ended.stdout:
        name, _, value = line.replace(str(side.cwd), "BASE").partition("=")
        entries = [
            entry
            for entry in value.split(":")
            if entry not in own and not re.search(r"/pipros\w*/share$", entry)
        ]
        lines.append(f"{name}={':'.join(entries)}")
    return lines
