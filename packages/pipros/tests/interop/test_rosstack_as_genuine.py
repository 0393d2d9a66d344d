"""`rosstack`, `rosclean`, `rosversion` and `roslaunch-complete` print the same as genuine ones."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.support.answers import ask
from tests.support.ros import RosSystem, Side

MANIFEST = (
    '<package format="2"><name>{name}</name><version>1.2.3</version><description>d</description>'
    '<maintainer email="a@b.c">m</maintainer><license>x</license>{more}</package>'
)

STACK_COMMANDS = (
    "rosstack",
    "rosstack help",
    "rosstack -h",
    "rosstack nonsense",
    "rosstack find one",
    "rosstack find",
    "rosstack find one two",
    "rosstack find nothing",
    "rosstack -q find nothing",
    "rosstack find -h",
    "rosstack contents one",
    "rosstack contents all_of_it",
    "rosstack contents nothing",
    "rosstack contents",
    "rosstack contains one",
    "rosstack contains",
    "rosstack contains nothing",
    "rosstack contains-path one",
    "rosstack contains-path nothing",
    "rosstack depends all_of_it",
    "rosstack deps1 all_of_it",
    "rosstack depends nothing",
    "rosstack depends-on one",
    "rosstack depends-on1 two",
    "rosstack depends-indent all_of_it",
    "rosstack depends-manifests two",
    "rosstack depends-manifests nothing",
    "rosstack depends-why --target=one all_of_it",
    "rosstack depends-why all_of_it",
    "rosstack depends-why --target=nothing all_of_it",
    "rosstack list extra",
    "rosstack plugins --attrib=x one",
    "rosversion one",
    "rosversion -s one",
    "rosversion nothing",
    "rosversion -d",
    "rosversion -d one",
    "rosversion -a one",
    "rosversion one two",
    "rosversion",
    "rosversion -h",
    "roslaunch-complete one start.launch",
    "roslaunch-complete one start.launch spe",
    "roslaunch-complete one nothing.launch",
    "roslaunch-complete one",
    "roslaunch-complete",
)


@pytest.fixture
def packages(ros: RosSystem) -> Path:
    """A metapackage of two packages, one with a launch file, alone on the path of both sides."""
    source = ros.home / "src"
    contents = {
        "one": "",
        "two": "<exec_depend>one</exec_depend>",
        "all_of_it": "<exec_depend>one</exec_depend><exec_depend>two</exec_depend>"
        "<export><metapackage/></export>",
    }
    for name, more in contents.items():
        (source / name).mkdir(parents=True)
        (source / name / "package.xml").write_text(MANIFEST.format(name=name, more=more))
    (source / "one" / "start.launch").write_text(
        '<launch><arg name="speed"/><arg name="late" default="1"/><arg name="fixed" value="2"/></launch>'
    )
    for side in (ros.genuine, ros.pipros):
        side.environment["ROS_PACKAGE_PATH"] = str(source)
        side.environment["ROS_DISTRO"] = "noetic"
        side.environment["PYTHONWARNINGS"] = "ignore"
    return source


@pytest.mark.timeout(400)  # a hundred processes
def test_both_print_the_same(ros: RosSystem, packages: Path) -> None:
    different = {}
    for line in STACK_COMMANDS:
        outcomes = [_outcome(side, line) for side in (ros.genuine, ros.pipros)]
        if outcomes[0] != outcomes[1]:
            different[line] = outcomes
    assert different == {}


def _outcome(side: Side, line: str) -> tuple[int | None, list[str], list[str]]:
    done = ask(side, *line.split())
    errors = [text for text in done.stderr if not text.startswith("could not find rosdep cache")]
    # Genuine rosstack prints these in the order in which the file system lists folders.
    is_unordered = line.startswith("rosstack depends-on")
    return done.returncode, sorted(done.stdout) if is_unordered else done.stdout, errors


def test_the_stacks_of_both_are_the_packages(ros: RosSystem, packages: Path) -> None:
    for command in ("list", "list-names"):
        genuine, pipros = (ask(side, "rosstack", command).stdout for side in (ros.genuine, ros.pipros))
        own = [line for line in genuine if line in ("one", "two", "all_of_it") or str(packages) in line]
        assert len(own) == 3
        assert [line for line in pipros if line in own] == own


CLEAN_COMMANDS = (
    "rosclean check",
    "rosclean purge --size 9",
    "rosclean purge -y --size 4",
    "rosclean check",
    "rosclean purge -y",
    "rosclean check",
    "rosclean nonsense",
    "rosclean purge -h",
)


def test_both_clean_alike(ros: RosSystem) -> None:
    transcripts = {}
    for side in (ros.genuine, ros.pipros):
        home = ros.home / "logs"
        for number in range(3):
            run = home / "log" / f"run{number}"
            run.mkdir(parents=True)
            (run / "x.log").write_bytes(b"x" * 2_000_000)
        (home / "rosmake").mkdir()
        transcript = []
        for line in CLEAN_COMMANDS:
            done = side.run(*line.split(), ROS_HOME=str(home), ROS_LOG_DIR=str(home / "log"))
            output = [_without_sizes(text) for text in done.stdout]
            left = sorted(path.name for path in home.glob("log/*"))
            transcript.append((line, done.returncode, output, done.stderr, len(left)))
        transcripts[side is ros.pipros] = transcript
    assert transcripts[True] == transcripts[False]


def _without_sizes(line: str) -> str:
    """Hide the sizes: those of folders depend on the file system, and du counts none on tmpfs."""
    return re.sub(r"^([\d.]+)[KM]? ", "SIZE ", line)
