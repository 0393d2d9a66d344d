"""Leave out the tests that need what is missing, which `python -m tests.support.left_out` lists.

In continuous integration nothing is left out: without genuine ROS 1 a run ends at once, and without the rest
its tests fail.
"""

import re
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.machinery import PathFinder  # not the hook for absent modules
from pathlib import Path

import pytest

from tests.support import (
    absent_plugins,
    bridge_clients,
    browser,
    dds_peers,
    genuine,
    pyright,
    ros2_wheels,
    windows,
)
from tests.support.environments import REPOSITORY

_MORE = "`script/test all` runs all tests, `script/test NAME` those of a plugin or package"
_AS_ROOT = "as root on Debian 12"
_WITH_NODE = "with Node.js"


@dataclass(frozen=True, slots=True)
class Need:
    """What some tests need.

    Attributes:
        missing: returns what of it this machine lacks.
        how: the command that installs it, and under which condition.
        folders, files: names of folders below PACKAGE/tests, and of files, whose tests need it.
        skipping: names of files with tests that look for it themselves.
    """

    what: str
    missing: Callable[[], Sequence[str]]
    how: str
    folders: Sequence[str] = ()
    files: Sequence[str] = ()
    skipping: Sequence[str] = ()


def _without(program: str) -> Callable[[], Sequence[str]]:
    return lambda: [] if shutil.which(program) else [program]


NEEDS = (
    Need("genuine ROS 1", lambda: genuine.missing_packages(), f"{genuine.INSTALL} ({_AS_ROOT})", ["interop"],
        ["test_rosbridge_clients.py"]),
    Need("Chromium", lambda: browser.missing(), f"{browser.INSTALL} ({_AS_ROOT})", ["browser"],
        ["test_rosbridge_clients.py"]),
    Need("npm", _without("npm"), f"apt-get install npm ({_AS_ROOT})", ["pyodide"]),
    Need("clients of bridges", lambda: bridge_clients.missing(), f"{bridge_clients.INSTALL} ({_WITH_NODE})",
        files=["test_rosbridge_clients.py"]),
    Need("Foxglove's client", lambda: bridge_clients.missing_foxglove(),
        f"{bridge_clients.INSTALL} ({_WITH_NODE})", files=["test_foxglove_client.py"]),
    Need("other DDS", lambda: dds_peers.missing(), f"{dds_peers.INSTALL} ({_AS_ROOT})", ["dds"]),
    Need("genuine ROS 2", lambda: ros2_wheels.missing(), f"{ros2_wheels.INSTALL} (Linux, x86_64)",
        files=["test_gateway_with_genuine_ros2.py", "test_one_environment.py"]),
    Need("Wine", lambda: windows.missing(), f"{windows.INSTALL} ({_AS_ROOT})", ["windows"]),
    Need("pyright", lambda: [] if pyright.find_pyright() else ["pyright"],
        f"{pyright.INSTALL} ({_WITH_NODE})", skipping=["test_type_checkers.py"]),
    Need("systemd", _without("systemd-analyze"), f"apt-get install systemd ({_AS_ROOT})",
        skipping=["test_examples.py"]),
)  # fmt: skip

# Of the groups of requirements in the pyproject.toml files.
_NAMES = """\
PIL bson cbor2 coverage cv2 em gymnasium h11 hatchling hokuyolx ipykernel lz4 matplotlib mcap mypy
nbclient numpy orjson playwright psutil pyrplidar rosbags ruff scipy setuptools tree_sitter urdf_parser_py
xacro"""
_ABSENT = [name for name in _NAMES.split() if PathFinder.find_spec(name) is None]
_LIBRARY = re.compile(rf"\b({'|'.join(_NAMES.split())})\b")


def libraries(path: Path) -> set[str]:
    """Return the libraries that a file of tests names: it imports them, or says so in a comment.

    A file that only mentions them has a comment `# needs no library`.
    """
    text = path.read_text(encoding="utf-8") if path.suffix == ".py" else ""
    return set() if "# needs no library" in text else set(_LIBRARY.findall(text))


def lacking_for(path: Path) -> Iterator[str]:
    """Yield what a file or folder of tests needs and this machine lacks."""
    folder = [*path.relative_to(REPOSITORY).parts, "", "", ""][3]  # PACKAGE/tests/FOLDER/…
    yield from (n.what for n in NEEDS if (folder in n.folders or path.name in n.files) and n.missing())
    if _ABSENT:
        yield from libraries(path).intersection(_ABSENT)


def add_options(parser: pytest.Parser) -> None:
    """Add the option `--default`."""
    parser.addoption("--default", action="store_true", help="say at the end that there are other tests")


def report(config: pytest.Config) -> list[str]:
    """Return the last lines of a run, at most three; none if nothing was left out."""
    if genuine.is_required():
        return []
    others = [_MORE] if config.getoption("--default") else []
    chosen = [(config.invocation_params.dir / each.partition("::")[0]).resolve() for each in config.args]
    files = {file for each in chosen for file in (each.rglob("test_*.py") if each.is_dir() else [each])}
    files = {each for each in files if each.is_relative_to(REPOSITORY)}
    lacked = {what for file in files for what in lacking_for(file)}
    lacked |= {n.what for n in NEEDS if {*n.skipping} & {each.name for each in files} and n.missing()}
    lacking = [each for each in (*(need.what for need in NEEDS), *_ABSENT) if each in lacked]
    if any(map(absent_plugins.is_needed_by, files)):
        lacking.append("other plugins")
    if lacking:
        others += [f"left out: tests that need {', '.join(lacking)}"]
        others += ["`.venv/bin/python -m tests.support.left_out` prints how to install what is missing"]
    return others


def refuse_without_genuine(arguments: Sequence[str]) -> None:
    """Raise UsageError if tests may be chosen that need genuine ROS 1, and this machine lacks it."""
    chosen = [[*Path(argument.partition("::")[0]).parts, "", "", ""][3] for argument in arguments]
    missing = genuine.missing_packages()
    if missing and (not chosen or {"", "interop"} & set(chosen)):
        lacking = f"genuine ROS 1 is needed here (CI is set) and lacks: {' '.join(missing)}"
        raise pytest.UsageError(f"{lacking}. As root: {genuine.INSTALL}")


if __name__ == "__main__":
    for each in NEEDS:
        if found := each.missing():
            print(f"{each.what} lacks {' '.join(found)}\n  {each.how}")
    if _ABSENT or absent_plugins.ABSENT:
        print(
            f"Python libraries and plugins: {' '.join([*_ABSENT, *absent_plugins.ABSENT])}\n  script/venv dev"
        )
