"""rospack, rosstack and rosclean have the output, errors and exit codes of the genuine ones."""

import itertools
import re
from pathlib import Path

import pytest

from pipros_tools.cli.rospack import main
from tests.support.ros import RosSystem, Side

MANIFEST = """\
<package format="{format}"><name>{name}</name><version>1.2.3</version><description>d</description>
<maintainer email="a@example.org">A</maintainer><license>BSD</license>
<buildtool_depend>catkin</buildtool_depend>{content}</package>
"""

PACKAGES = {
    "messages": (2, '<depend>bottom</depend><export><cpp cflags="-DM"/><cpp cflags="-DN"/></export>'),
    "bottom": (2, ""),
    "flags": (2, '<depend>messages</depend><export><cpp cflags="-I${prefix}/i" lflags="-la"/></export>'),
    "old_form": (
        1,
        "<build_depend>messages</build_depend><run_depend>flags</run_depend><run_depend>boost</run_depend>"
        '<export><rosbag migration_rule_file="r.bmr"/><messages plugin="${prefix}/p.xml"/></export>',
    ),
    "all_kinds": (
        2,
        "<depend>flags</depend><build_depend>bottom</build_depend><exec_depend>old_form</exec_depend>"
        "<build_export_depend>messages</build_export_depend><test_depend>nowhere</test_depend>"
        "<doc_depend>doxygen</doc_depend><export>"
        '<messages plugin="${prefix}/p2.xml"/><messages plugin="p3.xml"/><python path="x"/></export>',
    ),
    "all_of_them": (2, "<exec_depend>flags</exec_depend><export><metapackage/></export>"),
    "conditions": (3, '<exec_depend condition="$ROS_PYTHON_VERSION == 3">all_kinds</exec_depend>'),
}

DRY_MANIFEST = """\
<package><description brief="b">d</description><author>A</author><license>BSD</license>
<depend package="flags"/><depend package="bottom"/><rosdep name="boost"/>
<export><cpp cflags="-DD"/><messages plugin="${prefix}/p.xml"/></export></package>
"""

PKG_CONFIG = """\
Name: flags
Description: d
Version: 1
Cflags: -I/elsewhere/include -DFOO=1 -I{devel}/include
Libs: -L/elsewhere/lib -lfoo -Wl,-rpath,/x /abs/libz.so -L{devel}/lib
"""

# fmt: off
ABOUT_ONE = [
    "find", "depends", "deps", "depends1", "depends-indent", "depends-manifests", "depends-msgsrv",
    "depends-on", "depends-on1", "rosdep", "rosdep0", "vcs", "vcs0",
]
# fmt: on
FLAGS = ["cflags-only-I", "cflags-only-other", "libs-only-L", "libs-only-l", "libs-only-other"]

QUESTIONS = [
    *([command, package] for command in ABOUT_ONE for package in (*PACKAGES, "dry", "nowhere")),
    *([command, *more, "flags"] for command in FLAGS for more in ([], ["--deps-only"])),
    *([command, "bottom"] for command in FLAGS),
    *(["export", f"--lang={lang}", f"--attrib={attribute}", package]
      for lang, attribute in (("cpp", "cflags"), ("rosbag", "migration_rule_file"), ("messages", "plugin"))
      for package in ("flags", "old_form", "all_kinds", "dry")),
    ["export", "--lang=cpp", "--attrib=cflags", "--deps-only", "old_form"],
    ["export", "--lang=cpp", "flags"],
    ["plugins", "--attrib=plugin", "messages"],
    ["plugins", "--attrib=plugin", "--top=old_form", "messages"],
    ["plugins", "--attrib=plugin", "--top=nowhere", "messages"],
    ["plugins", "messages"],
    *(["depends-why", f"--target={target}", "all_kinds"] for target in ("bottom", "all_kinds", "nowhere")),
    ["depends-why", "--target=all_kinds", "bottom"],
    ["depends-why", "bottom"],
    ["find"],
    ["find", "a", "b"],
    ["-q", "find", "nowhere"],
    ["frobnicate"],
    ["help"],
    [],
]  # fmt: skip

UNSORTED = {"depends-on", "depends-on1", "plugins"}
"""Commands whose answers genuine rospack gives in the order of a hash table."""


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    base = tmp_path_factory.mktemp("rospack")
    for name, (form, content) in PACKAGES.items():
        folder = base / "src" / name
        folder.mkdir(parents=True)
        (folder / "package.xml").write_text(MANIFEST.format(format=form, name=name, content=content))
    (base / "src" / "stack" / "dry" / "inner").mkdir(parents=True)
    for folder in ("dry", "dry/inner"):
        (base / "src" / "stack" / folder / "manifest.xml").write_text(DRY_MANIFEST)
    for kind in ("msg", "srv"):
        (base / "src" / "messages" / kind).mkdir()
    devel = base / "devel"
    devel.mkdir()
    (devel / ".catkin").write_text(str(base / "src"))
    (base / "flags.pc").write_text(PKG_CONFIG.format(devel=devel))
    return base / "src"


@pytest.mark.parametrize("words", QUESTIONS, ids=" ".join)
def test_the_answer_is_that_of_genuine_rospack(words: list[str], source: Path, monkeypatch, capfd) -> None:
    base = source.parent
    environment = {
        "HOME": str(base), "ROS_PACKAGE_PATH": str(source), "CMAKE_PREFIX_PATH": str(base / "devel"),
        "PKG_CONFIG_PATH": str(base),
    }  # fmt: skip
    genuine = Side({"PATH": "/usr/bin:/bin", "LANG": "C.UTF-8", **environment}, base, is_genuine=True)
    answer = genuine.run("rospack", *words)
    theirs = comparable(words, answer.returncode, answer.stdout, answer.stderr)

    # In this process, because starting the interpreter would take most of the time.
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.chdir(base)
    code = main(words)
    printed = capfd.readouterr()
    assert comparable(words, code, printed.out.splitlines(), printed.err.splitlines()) == theirs


def comparable(words: list[str], code: int, out: list[str], err: list[str]) -> tuple[int, list[str], str]:
    """Return exit code, output and errors, without the lines that only genuine rospack prints."""
    complaint = "\n".join(itertools.dropwhile(lambda line: not line.startswith("[rospack]"), err))
    answer = sorted(out) if words and words[0] in UNSORTED else out
    if code and answer == [""]:
        answer = []  # an empty line despite the error
    return code, answer, re.sub(r".*(pkg-config --\S+ \S+)'.*", r"\1", complaint)


# `rosstack`, `rosclean`, `rosversion` and `roslaunch-complete` print the same as genuine ones.
STACK_MANIFEST = (
    '<package format="2"><name>{name}</name><version>1.2.3</version><description>d</description>'
    '<maintainer email="a@b.c">m</maintainer><license>x</license>{more}</package>'
)

STACK_COMMANDS = (
    "rosstack", "rosstack help", "rosstack -h", "rosstack nonsense", "rosstack find one", "rosstack find",
    "rosstack find one two", "rosstack find nothing", "rosstack -q find nothing", "rosstack find -h",
    "rosstack contents one", "rosstack contents all_of_it", "rosstack contents nothing", "rosstack contents",
    "rosstack contains one", "rosstack contains", "rosstack contains nothing", "rosstack contains-path one",
    "rosstack contains-path nothing", "rosstack depends all_of_it", "rosstack deps1 all_of_it",
    "rosstack depends nothing", "rosstack depends-on one", "rosstack depends-on1 two",
    "rosstack depends-indent all_of_it", "rosstack depends-manifests two",
    "rosstack depends-manifests nothing", "rosstack depends-why --target=one all_of_it",
    "rosstack depends-why all_of_it", "rosstack depends-why --target=nothing all_of_it",
    "rosstack list extra", "rosstack plugins --attrib=x one", "rosversion one", "rosversion -s one",
    "rosversion nothing", "rosversion -d", "rosversion -d one", "rosversion -a one", "rosversion one two",
    "rosversion", "rosversion -h", "roslaunch-complete one start.launch",
    "roslaunch-complete one start.launch spe", "roslaunch-complete one nothing.launch",
    "roslaunch-complete one", "roslaunch-complete",
)  # fmt: skip


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
        (source / name / "package.xml").write_text(STACK_MANIFEST.format(name=name, more=more))
    (source / "one" / "start.launch").write_text(
        '<launch><arg name="speed"/><arg name="late" default="1"/><arg name="fixed" value="2"/></launch>'
    )
    for side in (ros.genuine, ros.pipros):
        side.environment["ROS_PACKAGE_PATH"] = str(source)
        side.environment["ROS_DISTRO"] = "noetic"
        side.environment["PYTHONWARNINGS"] = "ignore"
    return source


def test_both_print_the_same(ros: RosSystem, packages: Path) -> None:
    different = {}
    for line in STACK_COMMANDS:
        outcomes = [_outcome(side, line) for side in (ros.genuine, ros.pipros)]
        if outcomes[0] != outcomes[1]:
            different[line] = outcomes
    assert different == {}


def _outcome(side: Side, line: str) -> tuple[int | None, list[str], list[str]]:
    done = side.run(*line.split())
    errors = [text for text in done.stderr if not text.startswith("could not find rosdep cache")]
    # Genuine rosstack prints these in the order in which the file system lists folders.
    is_unordered = line.startswith("rosstack depends-on")
    return done.returncode, sorted(done.stdout) if is_unordered else done.stdout, errors


def test_the_stacks_of_both_are_the_packages(ros: RosSystem, packages: Path) -> None:
    for command in ("list", "list-names"):
        genuine, pipros = (side.run("rosstack", command).stdout for side in (ros.genuine, ros.pipros))
        own = [line for line in genuine if line in ("one", "two", "all_of_it") or str(packages) in line]
        assert len(own) == 3
        assert [line for line in pipros if line in own] == own


CLEAN_COMMANDS = (
    "rosclean check", "rosclean purge --size 9", "rosclean purge -y --size 4", "rosclean check",
    "rosclean purge -y", "rosclean check", "rosclean nonsense", "rosclean purge -h",
)  # fmt: skip


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
