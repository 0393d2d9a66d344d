"""The Python API of roslaunch and its reader of launch files behave like the genuine ones."""

import difflib
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pipros_tools.launch.model import LaunchError
from tests.support.programs import make_programs
from tests.support.ros import RosSystem, Side
from tests.unit.launch.test_xml_as_genuine import FOLDER, described, load_case, sorted_text

PROGRAMS = Path(__file__).parent / "programs"

FILES = {
    "x.launch": """<launch>
  <arg name="n" default="a" doc="a name"/><arg name="r"/>
  <node pkg="programs" type="sleeper" name="$(arg n)" args="1 $(arg r)">
    <remap from="a" to="b"/><env name="E" value="v"/>
  </node>
  <include file="$(dirname)/y.launch"/><param name="q" value="1"/>
</launch>""",
    "y.launch": '<launch><node pkg="programs" type="fails" name="f" output="screen"/></launch>',
    "bad.launch": '<launch><arg name="w" default=""/><node pkg="a"/></launch>',
    "full.launch": """<launch>
  <arg name="x"/><arg name="d" default="dd"/><arg name="v" value="vv"/>
  <param name="p" value="7"/><param name="text" value="longer than twenty characters"/>
  <rosparam>{a: {b: [1, 2.5, yes]}}</rosparam>
  <group ns="g" clear_params="true">
    <node pkg="a" type="b" name="c" output="screen" respawn="true" respawn_delay="2"/>
  </group>
  <machine name="m" address="127.0.0.1" env-loader="/env.sh"/>
  <node pkg="a" type="b" name="d" cwd="ros_home" machine="m" args="&lt;$(arg x)&gt;" launch-prefix="nice">
    <remap from="x" to="y"/><env name="A" value="1"/><param name="z" value="1"/>
  </node>
  <node pkg="a" type="b" name="e" cwd="node" output="log" required="true" nonsense="1"/>
  <test pkg="a" type="t" test-name="tt" time-limit="3" retry="2"/>
  <test pkg="a" type="t" test-name="uu" name="named" ns="q"/>
  <rosparam command="dump" file="/o" ns="x"/>
</launch>""",
}

MANIFEST = (
    '<package format="2"><name>programs</name><version>0.0.1</version><description>d</description>'
    '<maintainer email="a@example.org">A</maintainer><license>Apache-2.0</license></package>'
)

DIFFERENT = {
    "no xml": "errors have the words of pipros, with file, line and column", "bad element": "likewise",
    "bad": "likewise", "errors": "the unknown attribute is named with its place",
    "unset ignored": "genuine reads nothing after the first argument that is not set",
}  # fmt: skip
"""Where pipros differs on purpose, by label; why."""


TEST_PROGRAM = """#!/usr/bin/env python3
import unittest, rosunit
class Cases(unittest.TestCase):
    def test_one(self): pass
    def test_two(self): self.assertEqual(1, 2)
rosunit.unitrun("programs", "case", Cases)
"""

TEST_FILE = """<launch>
  <node pkg="programs" type="sleeper" name="s"/>
  <test pkg="programs" type="prog.py" test-name="aa"/>
  <test pkg="programs" type="nope" test-name="bb"/>
  <test pkg="programs" type="ends" test-name="cc"/>
</launch>"""


@pytest.fixture
def package(ros: RosSystem) -> Path:
    """A package with programs and launch files, which both sides find."""
    programs = {
        "sleeper": "#!/bin/sh\nexec sleep 1000\n", "fails": "#!/bin/sh\nexit 3\n",
        "ends": "#!/bin/sh\nexit 0\n", "prog": "#!/bin/sh\n", "prog.py": TEST_PROGRAM,
    }  # fmt: skip
    folder = make_programs(ros.home / "src" / "programs", programs)
    (folder / "package.xml").write_text(MANIFEST)
    for name, text in {**FILES, "t.test": TEST_FILE}.items():
        (folder / name).write_text(text)
    for side in (ros.genuine, ros.pipros):
        side.environment["ROS_PACKAGE_PATH"] = f"{folder.parent}:{side.environment['ROS_PACKAGE_PATH']}"
    return folder


def outcomes(side: Side, program: str, folder: Path) -> list[str]:
    """Return the `label | outcome` lines of the program's output."""
    ended = side.run("python3", "-W", "ignore", PROGRAMS / program, folder, timeout_s=240, ROS_IP="127.0.0.1")
    assert ended.returncode == 0, ended.output
    found = []
    for line in ended.stdout:
        # The output of a thread may be in the same line, before it and after it.
        _, mark, record = line.partition("@@")
        if mark:
            label, outcome = json.JSONDecoder().raw_decode(record)[0]
            if label not in DIFFERENT:
                found.append(f"{label} | {json.dumps(outcome)}")
    return found


def test_the_library_does_what_genuine_roslaunch_does(ros: RosSystem, package: Path) -> None:
    ros.pipros.start_master()
    genuine, ours = (outcomes(side, "examine_launch.py", package) for side in (ros.genuine, ros.pipros))
    assert len(genuine) > 170
    assert "\n".join(difflib.unified_diff(genuine, ours, "genuine", "pipros", lineterm="", n=0)) == ""


def test_the_libraries_of_tests_do_what_genuine_ones_do(ros: RosSystem, package: Path) -> None:
    genuine, ours = (outcomes(side, "examine_rostest.py", package) for side in (ros.genuine, ros.pipros))
    assert len(genuine) > 44
    assert "\n".join(difflib.unified_diff(genuine, ours, "genuine", "pipros", lineterm="", n=0)) == ""


# `$(…)`, above all `$(eval …)`, has the same results as in genuine roslaunch.
PROGRAM = Path(__file__).parent / "programs" / "examine_substitutions.py"

TEXTS = """\
plain $x $ ( ) text
$(arg a)/$(arg s)
$(find roslib)$(find rospy)
$(optenv NOPE a  b)
$(dirname)/..
$(eval a + 1)
$(eval arg('a') * 2)
$(eval not b)
$(eval b and a > 2)
$(eval n * -2)
$(eval empty == '')
$(eval numbers)
$(eval optenv('NOPE', 0))
$(eval optenv('NOPE', 0) + 1)
$(eval optenv('NOPE', 'x') + 'y')
$(eval optenv('NOPE'))
$(eval env('PATH')[:0] + 'p')
$(eval dirname() + '/z')
$(eval s.lower())
$(eval s.upper() + '!')
$(eval s.title())
$(eval s.capitalize().swapcase())
$(eval '  x '.strip() + '|')
$(eval ' x '.lstrip() + ' x '.rstrip() + '|')
$(eval s.split())
$(eval s.split(' ')[1])
$(eval 'a,b,c'.split(',', 1))
$(eval 'a,b,c'.rsplit(',', 1))
$(eval 'a-b'.partition('-'))
$(eval path.rpartition('/')[2])
$(eval path.replace('.bag', '.csv'))
$(eval path.replace('/', '-', 1))
$(eval '-'.join(['x', 'y']))
$(eval '-'.join(s.split()))
$(eval path.startswith('/x') and path.endswith('.bag'))
$(eval s.startswith(('x', 'h')))
$(eval s.find('there') + s.rfind('h'))
$(eval s.index('t') + s.count('e'))
$(eval 'no'.find('z'))
$(eval '7'.zfill(3))
$(eval 'x'.center(7, '*') + 'x'.ljust(3) + 'x'.rjust(3))
$(eval '12'.isdigit() and 'ab'.isalpha() and 'a1'.isalnum())
$(eval 'AB'.isupper() or 'ab'.islower())
$(eval ' '.isspace())
$(eval '{}/{}'.format(s, a))
$(eval '{1}-{0}'.format(s, a))
$(eval '{x:>5}|{x:<5}|{x:^5}'.format(x=a))
$(eval '{:.2f}'.format(n))
$(eval '{0[1]}'.format([1, 2]))
$(eval '{0!r:>6}'.format('x'))
$(eval '{:{}}'.format(a, 4))
$(eval '{{{}}}'.format(a))
$(eval '%s_%02d' % (s, a))
$(eval {'x': 1}.get('x', 2))
$(eval {'x': 1}.get('y', 2))
$(eval {'x': 1}.get('y'))
$(eval sorted({'x': 1, 'a': 2}.keys()))
$(eval list({'x': 1}.items()))
$(eval list({'x': 1}.values()))
$(eval {'sim': 'gazebo', 'real': 'driver'}['sim'])
$(eval [1, 2, 1].count(1) + [1, 2].index(2))
$(eval list(map(float, '1 2'.split())))
$(eval list(map(int, ['1', '2'])))
$(eval sum(map(float, '1 2'.split())))
$(eval ','.join(map(str, [1, 2.5])))
$(eval [x * 2 for x in [1, 2, 3]])
$(eval [x for x in range(5) if x % 2])
$(eval [x + y for x in [1, 2] for y in [10, 20]])
$(eval [[y for y in range(x)] for x in range(3)])
$(eval {x: x * x for x in range(3)})
$(eval sorted({x % 2 for x in range(5)}))
$(eval sum(x for x in range(4)))
$(eval any(c.isdigit() for c in 'a1'))
$(eval all([c.isdigit() for c in 'a1']))
$(eval ' '.join(c.upper() for c in s.split()))
$(eval [k + v for k, v in [('a', 'b'), ('c', 'd')]])
$(eval dict((k, len(k)) for k in ['a', 'bb']))
$(eval sorted(['bb', 'a'], key=len))
$(eval max(['bb', 'a'], key=len))
$(eval [i + c for i, c in enumerate([1, 2])])
$(eval list(reversed([1, 2])))
$(eval list(zip('ab', [1, 2])))
$(eval list(filter(None, [0, 1])))
$(eval sqrt(16) + pi * 0)
$(eval int(ceil(2.1)))
$(eval round(degrees(pi)))
$(eval str(a) + 'x' if b else 'no')
$(eval float('1e3'))
$(eval int('ff', 16))
$(eval bool(a) and True and true)
$(eval len(s) - len(s.split()))
$(eval min(1, 2) + max(3, 4) + abs(-1))
$(eval a in [1, 2, 3])
$(eval 'hi' in s)
$(eval s[::-1])
$(eval s[0:2] + s[-1])
$(eval (1, 2) + (3,))
$(eval a if a > 5 else -a)
$(eval 7 // 2 * 2 ** 3 % 5)
$(eval 1 < a < 5)
$(eval nope)
$(eval 1 / 0)
$(eval s.nope())
$(eval a.b)
$(eval int('x'))
$(eval [][0])
$(eval {}['x'])
$(eval 1 +)
$(eval ''.join([1]))
$(eval 'abc'.index('z'))
$(eval '{}'.format())
$(eval [x for x in 5])
$(eval [x for x, y in [(1, 2, 3)]])
$(eval __import__('os'))
$(arg nope)
$(env NOPE_NOPE)
$(nope x)
$(find nope_nope_nope)
$(arg a b)
$(arg)
""".splitlines()


def substituted(side: Side) -> list[dict[str, Any]]:
    texts = side.home / "texts.txt"
    texts.write_text("\n".join(TEXTS))
    ended = side.run("python3", PROGRAM, texts)
    assert ended.returncode == 0, ended.output
    return [json.loads(line) for line in ended.stdout]


def test_each_text_has_the_same_result_as_in_genuine_ros(ros: RosSystem) -> None:
    """Errors must occur on both sides; their classes are compared only if scripts catch them."""
    ours, genuine = substituted(ros.pipros), substituted(ros.genuine)
    share = "/usr/share/"
    different = []
    for text, own, theirs in zip(TEXTS, ours, genuine, strict=True):
        if "find" in text and "result" in theirs and share in theirs["result"]:
            continue  # packages of pipros are elsewhere
        if ("error" in own) != ("error" in theirs) or own.get("result") != theirs.get("result"):
            different.append((text, own, theirs))
    assert different == []


# Every attribute of every element of launch files, and every element in every other, against genuine.
ELEMENTS = {
    "node": {"pkg": "p", "type": "t", "name": "n"}, "test": {"pkg": "p", "type": "t", "test-name": "n"},
    "param": {"name": "a", "value": "1"}, "rosparam": {"param": "k"}, "remap": {"from": "a", "to": "b"},
    "env": {"name": "A", "value": "b"}, "arg": {"name": "z", "default": "1"},
    "machine": {"name": "m", "address": "h"}, "include": {"file": "$(dirname)/plain.launch"},
    "group": {"ns": "g"}, "master": {},
}  # fmt: skip
NODE = "pkg type machine name args output respawn respawn_delay cwd ns clear_params launch-prefix required"
ATTRIBUTES = {
    "node": NODE, "test": f"{NODE} test-name time-limit retry",
    "param": "name value type textfile binfile command", "rosparam": "command ns file param subst_value",
    "remap": "from to", "env": "name value", "arg": "name value default doc",
    "machine": "name address env-loader ssh-port user password default timeout ros-root ros-ip ros-hostname",
    "include": "file ns clear_params pass_all_args", "group": "ns clear_params", "master": "auto uri",
}  # fmt: skip
VALUES = ("", " ", "x", "2", "-1", "TRUE", "/a", "$(arg u)")

BETTER = {
    '<rosparam param="k" command="dump" file="">': "an empty file is no file",
    '<machine name="m" address="h" ssh-port="-1">': "no port has this number",
}
"""Starts of cases in which pipros differs on purpose."""


def element(tag: str, attributes: dict[str, str], inside: str = "") -> str:
    written = "".join(f' {name}="{value}"' for name, value in attributes.items())
    return f"<{tag}{written}>{'{a: 1}' if tag == 'rosparam' else ''}{inside}</{tag}>"


def cases() -> Iterator[str]:
    for tag, base in ELEMENTS.items():
        for name in (*ATTRIBUTES[tag].split(), "if", "unless", "unknown"):
            for value in VALUES:
                yield element(tag, {**base, name: value})
                if tag == "param":
                    yield element(tag, {"name": "a", name: value})
                if tag == "rosparam":
                    yield element(tag, {**base, "command": "delete", name: value})
                    yield element(tag, {**base, "command": "dump", name: value})
        for name in base:
            yield element(tag, {key: value for key, value in base.items() if key != name})
        yield element(tag, base) * 2
        yield element(tag.upper(), base)
        for outer, attributes in ELEMENTS.items():
            for inner in (tag, tag.capitalize(), "launch", "unknown"):
                yield element(outer, attributes, element(inner, base))
            yield element(outer, attributes, element(tag, base) * 2)


def test_every_attribute_and_every_nesting_has_the_outcome_of_genuine_roslaunch(ros, tmp_path) -> None:
    folder = tmp_path / "files"
    shutil.copytree(FOLDER / "files", folder)
    (tmp_path / "cases.txt").write_text("".join(f"{case}\n" for case in dict.fromkeys(cases())))
    script = Path(__file__).parent / "programs" / "genuine_launch_loader.py"

    ended = ros.genuine.run(
        "python3", script, tmp_path / "cases.txt", folder, ROS_PACKAGE_PATH="/usr/share", timeout_s=240
    )

    rows = [json.loads(line) for line in ended.stdout]
    assert len(rows) > 1500
    differing = {}
    for case, genuine in ((row["case"], row["genuine"]) for row in rows):
        if case.startswith(tuple(BETTER)):
            continue
        try:
            launch = load_case(case, folder)
        except LaunchError as error:
            ours = f"refused: {error.reason}"
            is_same = "error" in genuine
        else:
            warned = genuine.pop("warnings", 0)
            ours = json.dumps(described(launch)).replace(str(folder), "{folder}")
            is_same = sorted_text(json.loads(ours)) == sorted_text(genuine) and len(launch.warnings) >= warned
        if not is_same:
            differing[case] = ours, genuine
    assert differing == {}
