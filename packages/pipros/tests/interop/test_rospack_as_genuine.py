"""rospack has the same output, errors and exit codes as the genuine one, on the same packages."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import pytest

from pipros_tools.cli.rospack import main
from tests.support.answers import ask
from tests.support.ros import Side

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
def test_the_answer_is_that_of_genuine_rospack(
    words: list[str],
    source: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    base = source.parent
    environment = {
        "HOME": str(base),
        "ROS_PACKAGE_PATH": str(source),
        "CMAKE_PREFIX_PATH": str(base / "devel"),
        "PKG_CONFIG_PATH": str(base),
    }
    genuine = Side({"PATH": "/usr/bin:/bin", "LANG": "C.UTF-8", **environment}, base, is_genuine=True)
    answer = ask(genuine, "rospack", *words)
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
