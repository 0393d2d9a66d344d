"""rosunit, rostest and its test nodes end, report and write result files as the genuine ones do."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.ports import ClaimedPort
from tests.support.processes import Process
from tests.support.ros import RosSystem, Side
from tests.support.rostest_nodes import SCENES, LevelSystem, Scene, cases_in

KINDS = """#!/usr/bin/env python3
import sys, unittest

class Kinds(unittest.TestCase):
    def test_a_passes(self):
        print("to out")
        print("to err", file=sys.stderr)
    def test_b_fails(self):
        self.assertEqual(1, 2, "they differ, é")
    def test_c_errs(self):
        raise KeyError("gone")
    @unittest.skip("no reason")
    def test_d_is_skipped(self):
        pass
    @unittest.expectedFailure
    def test_e_fails_as_expected(self):
        self.fail()

if __name__ == "__main__":
    import rosunit
    rosunit.unitrun("kinds", "kinds", Kinds)
"""
FINE = """#!/usr/bin/env python3
import os, sys, unittest

class Fine(unittest.TestCase):
    def test_it(self):
        print(sys.argv[1:3], [arg.split(":=")[0] for arg in sys.argv[3:]])
        print(os.getcwd(), os.environ["ROS_MASTER_URI"].split(":")[1])

if __name__ == "__main__":
    import rostest
    rostest.rosrun("kinds", "fine", Fine)
"""
NAMED = """#!/usr/bin/env python3
import sys, unittest
import rospy

class Named(unittest.TestCase):
    def test_it(self):
        rospy.init_node("own")
        print(rospy.get_name(), rospy.get_param("~p", None), sys.argv[-2])

if __name__ == "__main__":
    import rostest
    rostest.rosrun("kinds", "fine", Named)
"""
FILES = {
    "package.xml": "<package><name>kinds</name><version>0.0.0</version><description>d</description>"
    "<maintainer email='a@example.com'>a</maintainer><license>none</license></package>",
    "test/kinds.py": KINDS,
    "test/fine.py": FINE,
    "test/named.py": NAMED,
    "test/nothing.py": "#!/usr/bin/env python3\n",
    "test/stays.py": "#!/usr/bin/env python3\nimport signal\nsignal.pause()\n",
    "test/fine.test": '<launch><param name="level" value="25"/>'
    '<test test-name="fine" pkg="kinds" type="fine.py" args="a b"/></launch>',
    "test/named.test": '<launch><test test-name="fine" name="node" pkg="kinds" type="named.py">'
    '<param name="p" value="5"/></test></launch>',
    "test/two.test": '<launch><test test-name="kinds" pkg="kinds" type="kinds.py"/>'
    '<test test-name="fine" pkg="kinds" type="fine.py"/></launch>',
    "test/nothing.test": '<launch><test test-name="nothing" pkg="kinds" type="nothing.py"/></launch>',
    "test/slow.test": '<launch><test test-name="slow" pkg="kinds" type="stays.py" time-limit="0.5"/>'
    "</launch>",
    "test/none.test": '<launch><node name="n" pkg="kinds" type="stays.py"/></launch>',
    "test/nopkg.test": '<launch><test test-name="fine" pkg="nopkg" type="fine.py"/></launch>',
    "test/absent.test": '<launch><test test-name="fine" pkg="kinds" type="absent.py"/></launch>',
    "test/nonode.test": '<launch><node name="n" pkg="kinds" type="absent.py"/>'
    '<test test-name="fine" pkg="kinds" type="fine.py"/></launch>',
    "test/twice.test": '<launch><test test-name="fine" pkg="kinds" type="fine.py"/>'
    '<test test-name="fine" pkg="kinds" type="fine.py"/></launch>',
}


@pytest.fixture
def package(ros: RosSystem, tmp_path: Path) -> Path:
    folder = tmp_path / "ws" / "kinds"
    for name, content in FILES.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(content)
        file.chmod(0o755 if name.endswith(".py") else 0o644)
    for side in (ros.pipros, ros.genuine):
        path = side.environment["ROS_PACKAGE_PATH"]
        side.environment["ROS_PACKAGE_PATH"] = f"{folder.parent}:{path}"
    return folder


def run(side: Side, *command: str) -> tuple[Process, dict[str, str]]:
    """Return the ended program, and its result files by name."""
    results = Path(side.environment["ROS_HOME"]) / "results"
    ended = side.run(*command, timeout_s=100, ROS_TEST_RESULTS_DIR=str(results))
    left = {file.name: file.read_text() for file in results.rglob("*.xml")}
    for file in results.rglob("*.xml"):
        file.unlink()
    return ended, left


def comparable(text: str) -> str:
    """Return the text without parts that vary between runs, and without frames of unittest and rostest."""
    text = re.sub(r'time="[\d.]+"', "time", text)
    text = re.sub(r"rostest-[\w.-]+-\d+\.log", "rostest.log", text)
    text = re.sub(r'(?m)^  File "[^"]*/(unittest|rostest|rosunit|roslaunch|rospkg)/.*\n(    .*\n)*', "", text)
    text = re.sub(r"(?m)^cannot launch node of type .*\n", "", text)  # a reason that only pipros adds
    # genuine ROS prints these before reasons that are complete without them
    return text.replace("False is not true : ", "").replace("[Errno 111] ", "")


def test_a_test_script_reports_and_leaves_results_as_with_genuine_rosunit(ros, package: Path) -> None:
    script = str(package / "test" / "kinds.py")

    ours, our_files = run(ros.pipros, script)
    theirs, their_files = run(ros.genuine, script)

    assert (ours.returncode, theirs.returncode) == (1, 1)
    assert comparable("\n".join(ours.stdout)) == comparable("\n".join(theirs.stdout))
    assert list(our_files) == ["rosunit-kinds.xml"]
    assert comparable(our_files["rosunit-kinds.xml"]) == comparable(their_files["rosunit-kinds.xml"])


@pytest.mark.parametrize(
    ("file", "code"),
    [
        ("fine.test", 0), ("named.test", 0), ("two.test", 2), ("nothing.test", 1), ("slow.test", 1),
        ("none.test", 0), ("nopkg.test", 1), ("absent.test", 1), ("nonode.test", 1), ("twice.test", 1),
    ],
)  # fmt: skip
def test_rostest_reports_and_ends_as_genuine_does(ros, package: Path, file: str, code: int) -> None:
    ours, our_files = run(ros.pipros, "rostest", "kinds", file)
    theirs, their_files = run(ros.genuine, "rostest", "kinds", file)

    assert (ours.returncode, theirs.returncode) == (code, code), ours.output
    assert comparable("\n".join(ours.stdout)) == comparable("\n".join(theirs.stdout))
    # The genuine one writes an empty result file for a program that was ended.
    their_files = {name: text for name, text in their_files.items() if "<testsuite" in text}
    assert sorted(our_files) == sorted(their_files)
    for name in our_files:
        if name.startswith("rosunit"):
            assert comparable(our_files[name]) == comparable(their_files[name])
        else:
            assert _cases(our_files[name]) == _cases(their_files[name])


@pytest.mark.parametrize(
    "options",
    [
        ["--results-filename=a.b.c", "kinds", "fine.test"],
        ["--results-base-dir={package}/elsewhere", "kinds", "fine.test"],
        ["--package=kinds", "--pkgdir={package}", "{package}/test/fine.test"], ["{package}/test/fine.test"],
        ["--reuse-master", "kinds", "fine.test"], ["--clear", "kinds", "fine.test"],
        ["kinds", "fine.test", "two.test"], ["kinds", "nope.test"], ["nopkg", "nope.test"], [],
    ],
    ids=lambda options: " ".join(options) or "nothing",
)  # fmt: skip
def test_options_of_rostest_have_the_effect_of_genuine_ones(ros, package: Path, options: list[str]) -> None:
    options = [option.replace("{package}", str(package)) for option in options]

    ours, our_files = run(ros.pipros, "rostest", *options)
    theirs, their_files = run(ros.genuine, "rostest", *options)

    assert ours.returncode == theirs.returncode
    assert comparable("\n".join(ours.stdout)) == comparable("\n".join(theirs.stdout))
    assert [line for line in ours.stderr if not line.startswith("Did you mean ")] == theirs.stderr
    assert sorted(our_files) == sorted(their_files)


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["test/kinds.py"], 2), (["test/fine.py", "a", "b"], 0),
        (["--name=other", "--package=pkg", "test/fine.py"], 0), (["test/nothing.py"], 1),
        (["--time-limit=0.5", "test/stays.py"], 1), (["test/fine.py", "--package=pkg", "--name=o 'b/c"], 0),
    ],
    ids=lambda words: " ".join(words) if isinstance(words, list) else "",
)  # fmt: skip
def test_the_command_rosunit_runs_a_test_program_as_genuine_does(ros, package, words, code: int) -> None:
    # Genuine rosunit starts Python as `python`, which Debian no longer has.
    (ros.home / "python").symlink_to("/usr/bin/python3")
    ros.genuine.environment["PATH"] += f":{ros.home}"
    words = [word.replace("test/", f"{package}/test/") for word in words]

    ours, our_files = run(ros.pipros, "rosunit", *words)
    theirs, their_files = run(ros.genuine, "rosunit", *words)

    assert (ours.returncode, theirs.returncode) == (code, code), ours.output + theirs.output
    assert comparable("\n".join(ours.stdout)) == comparable("\n".join(theirs.stdout))
    assert sorted(our_files) == sorted(their_files)
    for name in our_files:
        assert _cases(our_files[name]) == _cases(their_files[name])


def _cases(text: str) -> list[str]:
    """Return the cases of a result file with their outcomes, without output."""
    cases = comparable(text).partition("<system-out>")[0]
    return re.sub(r'type="\w+"', "type", cases).splitlines()


RESULTS = {
    "one/rosunit-a.xml": '<testsuite tests="2" errors="0" failures="1" time="0.5" name="a">'
    '<testcase classname="A" name="good" time="0.1"/><testcase classname="A" name="bad" time="0.2">'
    '<failure type="AssertionError">1 is not 2</failure></testcase></testsuite>',
    "two/rosunit-b.xml": '<testsuite tests="1" errors="0" failures="0" time="0.5" name="b">'
    '<testcase classname="B" name="good" time="0.1"/></testsuite>',
    "two/rosunit-c.xml": "no XML",
}


def make_results(ros: RosSystem) -> Path:
    """A folder with results of two packages, for both sides."""
    folder = ros.home / "results"
    shutil.rmtree(folder, ignore_errors=True)
    for name, content in RESULTS.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)
    for side in (ros.genuine, ros.pipros):
        side.environment["ROS_TEST_RESULTS_DIR"] = str(folder)
    return folder


@pytest.mark.parametrize(
    "words",
    [
        "summarize_results.py --nodeps one", "summarize_results.py --nodeps std_msgs", "summarize_results.py",
        "test_results_dir.py", "check_test_ran.py results/one/rosunit-a.xml",
        "check_test_ran.py results/three/rosunit-gone.xml",
    ],
)  # fmt: skip
def test_the_helper_programs_of_rosunit_behave_like_genuine_ones(ros: RosSystem, words: str) -> None:
    outcomes = []
    for side in (ros.genuine, ros.pipros):
        folder = make_results(ros)
        program, *arguments = words.split()
        ended = side.run(*side.node("rosunit", program), *arguments)
        files = sorted(str(file.relative_to(folder)) for file in folder.glob("*/*.xml"))
        outcomes.append((ended.returncode, ended.stdout, ended.stderr, files))
    assert outcomes[1] == outcomes[0]


def test_genuine_programs_read_what_the_helper_programs_wrote(ros: RosSystem) -> None:
    folder = make_results(ros)
    ros.pipros.run("rosrun", "rosunit", "check_test_ran.py", "results/three/rosunit-gone.xml")
    assert ros.pipros.run("rosrun", "rosunit", "clean_junit_xml.py").returncode == 0
    cleaned = {file.name for file in (folder / "_hudson").iterdir()}
    assert {"one.rosunit-a.xml", "three.rosunit-gone.xml", "two.rosunit-b.xml"} <= cleaned
    counted = ros.genuine.run("rosrun", "rosunit", "summarize_results.py", "--nodeps", "_hudson")
    assert " * TESTS: 4" in counted.stdout
    assert counted.returncode == 1


# The test nodes of rostest have the same parameters, cases and exit codes as the genuine ones.
GENUINE_NODES = Path("/usr/share/rostest/nodes")


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory, bare_tools: Path) -> Iterator[LevelSystem]:
    port = ClaimedPort()
    ros = RosSystem(port.number, tmp_path_factory.mktemp("level"), bare_tools)
    system = LevelSystem(ros, ros.genuine, "/usr/bin/python3", GENUINE_NODES)
    yield system
    system.close()
    ros.close()
    port.release()


@pytest.mark.parametrize("scene", SCENES, ids=[f"{scene.node} {scene.params}" for scene in SCENES])
def test_a_genuine_test_node_ends_as_ours_does(system: LevelSystem, scene: Scene) -> None:
    """tests/graph/test_rostest_nodes.py tests our outcomes with the same scenes."""
    ended, cases = system.run(scene, f"scene_{SCENES.index(scene)}")

    assert ended.returncode == (0 if scene.passes else 1), ended.output
    assert cases == scene.cases


@pytest.mark.parametrize("scene", [SCENES[0], SCENES[-1]], ids=["passes", "fails"])
def test_a_genuine_rostest_runs_them_as_ours_does(ros: RosSystem, scene: Scene) -> None:
    scene.write(ros.home / "ws")
    ros.genuine.environment["ROS_PACKAGE_PATH"] = f"{ros.home / 'ws'}:/usr/share"

    ran = ros.genuine.run("rostest", "around", "scene.test", timeout_s=120)

    assert ran.returncode == (0 if scene.passes else 2), ran.output
    assert scene.cases == cases_in(ros.home / ".ros/test_results/around/rosunit-scene.xml")


def test_each_genuine_test_node_has_its_counterpart() -> None:
    import pipros

    ours = {file.name for file in (Path(pipros.__file__).parent / "share/rostest/nodes").iterdir()}

    assert {file.name for file in GENUINE_NODES.iterdir()} <= ours
