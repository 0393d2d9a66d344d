"""The pytest plugin in a separate pytest run: collected launch files, fixtures and failure reports."""

from __future__ import annotations

import re
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.support.environments import EXAMPLES, REPOSITORY

pytest_plugins = ["pytester"]

MANIFEST = "<package><name>pkg</name></package>"
TEST = """#!/usr/bin/env python3
import sys, unittest
import rostest, rospy

class T(unittest.TestCase):
    def test_level(self):
        print("this was printed")
        self.assertEqual(rospy.get_param("/level"), 25, "the level is wrong")

    def test_nothing(self):
        pass

if __name__ == "__main__":
    rostest.rosrun("pkg", "t", T)
"""
LAUNCH = """<launch>
  <arg name="level" default="25"/>
  <param name="/level" value="$(arg level)"/>
  <test test-name="first" pkg="pkg" type="t.py"/>
  <test test-name="second" pkg="pkg" type="t.py"/>
</launch>"""

TEST_OF = "<test test-name='t' pkg="

PATIENT = {
    "hzerror: 0.5, test_duration: 3.0": "hzerror: 0.9, test_duration: 6.0",
    "timeout: 10,": "timeout: 60,",
    "heard, what=": "heard, timeout_s=60, what=",
    "connection_count == 1, what=": "connection_count == 1, timeout_s=60, what=",
}
"""Limits in the examples of the documentation, and those for a busy machine."""

Run = Callable[..., pytest.RunResult]


@pytest.fixture
def run(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Run:
    """pytest with the plugin, in its own process and folder, which is also a package."""
    monkeypatch.setenv("ROS_HOME", str(pytester.path / ".ros"))
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{pytester.path}:{EXAMPLES}")
    for name, content in {"package.xml": MANIFEST, "t.py": TEST, "level.test": LAUNCH}.items():
        (pytester.path / name).write_text(content)
    (pytester.path / "t.py").chmod(0o755)

    def run_pytest(*words: str) -> pytest.RunResult:
        plugin = ("-p", "no:pipros", "-p", "pipros.testing.pytest_plugin")
        return pytester.runpytest_subprocess(*plugin, "-p", "no:cacheprovider", *words)

    return run_pytest


def write(pytester: pytest.Pytester, name: str, content: str) -> None:
    (pytester.path / name).write_text(textwrap.dedent(content))


def test_each_test_of_a_launch_file_is_an_item(run: Run) -> None:
    result = run("-v")

    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(["level.test::first PASSED*", "level.test::second PASSED*"])


def test_one_test_of_a_file_can_be_chosen(run: Run) -> None:
    run("level.test::second").assert_outcomes(passed=1)
    run("-k", "first").assert_outcomes(passed=1, deselected=1)


def test_a_launch_file_is_collected_when_it_has_tests_and_other_files_are_not(
    run: Run, pytester: pytest.Pytester
) -> None:
    write(pytester, "tests.launch", LAUNCH)
    write(pytester, "nodes.launch", "<launch><node name='n' pkg='pkg' type='t.py'/></launch>")
    write(pytester, "other.test", "a test of some other program")

    result = run("--collect-only", "-q")

    assert result.outlines[:4] == [
        "level.test::first",
        "level.test::second",
        "tests.launch::first",
        "tests.launch::second",
    ]
    assert "4 tests collected" in result.outlines[-1]


def test_a_failure_shows_the_text_of_the_test_program_and_none_of_our_frames(run: Run) -> None:
    result = run("level.test::first", "--ros-arg", "level:=26")

    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        [
            "*_ <test> first _*",
            "FAILURE: test_level (__main__.T)",
            "26 != 25 : the level is wrong",
            '  File "*/t.py", line 8, in test_level',
            "*- Captured stdout of first call -*",
            "this was printed",
            "FAILED level.test::first - *",
        ]
    )
    output = result.stdout.str()
    assert "Traceback" not in output
    assert "pipros/testing" not in output
    assert "test_nothing" not in output


@pytest.mark.parametrize(
    ("element", "expected"),
    [
        (f"{TEST_OF}'pkg' type='gone.py'/>", "[pkg/gone.py] does not exist or is not executable"),
        (f"{TEST_OF}'gone' type='t.py'/>", "Package [gone] for test node [gone/t.py] does not exist"),
        (
            f"<node name='n' pkg='pkg' type='gone.py'/>{TEST_OF}'pkg' type='t.py'/>",
            "Test Fixture Nodes ['n'] failed to launch",
        ),
        (f"{TEST_OF}'pkg' type='stays.py' time-limit='0.3'/>", "max time [0.3s] allotted for test [t]"),
        (f"{TEST_OF}'pkg' type='silent.py'/>", "test [t] did not generate test results"),
    ],
)
def test_a_test_that_cannot_run_says_why(
    run: Run, pytester: pytest.Pytester, element: str, expected: str
) -> None:
    write(pytester, "level.test", f"<launch>{element}</launch>")
    for name, body in {"stays.py": "import signal; signal.pause()", "silent.py": ""}.items():
        write(pytester, name, f"#!/usr/bin/env python3\n{body}\n")
        (pytester.path / name).chmod(0o755)

    result = run()

    result.assert_outcomes(failed=1)
    report = result.stdout.str().partition("= FAILURES =")[2].partition("Captured")[0]
    assert expected in report
    assert "Traceback" not in report


def test_a_launch_file_with_a_mistake_is_an_error_of_collection_in_words(
    run: Run, pytester: pytest.Pytester
) -> None:
    write(pytester, "level.test", '<launch>\n<test test-name="$(arg gone)" pkg="pkg" type="t.py"/></launch>')

    result = run()

    assert result.ret == pytest.ExitCode.INTERRUPTED
    output = result.stdout.str()
    assert "level.test:2" in output
    assert "gone" in output
    assert "Traceback" not in output


def test_runs_are_private_and_leave_no_results_behind(run: Run, pytester: pytest.Pytester) -> None:
    run("level.test::first").assert_outcomes(passed=1)

    assert not (pytester.path / ".ros/test_results").exists()


def test_the_examples_of_the_documentation_work(run: Run, pytester: pytest.Pytester) -> None:
    text = (REPOSITORY / "docs/testing.md").read_text()
    examples = re.findall(r"```(?:python|xml)\n(?:# |<!-- )([\w.]+)(?: -->)?\n(.*?)```", text, re.DOTALL)
    for name, content in examples:
        for hasty, patient in PATIENT.items():
            content = content.replace(hasty, patient)
        write(pytester, name, content)

    result = run("-v")

    assert [name for name, _ in examples] == [
        "level.test",
        "test_battery.py",
        "listener.launch",
        "test_bad_network.py",
    ]
    result.assert_outcomes(passed=7)


def test_a_respawning_node_is_restarted_and_one_without_a_program_is_named(
    run: Run, pytester: pytest.Pytester
) -> None:
    write(pytester, "ends.py", "#!/bin/sh\necho ended >>ends\nexit 3\n")
    (pytester.path / "ends.py").chmod(0o755)
    write(
        pytester,
        "nodes.launch",
        """<launch><arg name="again"/>
        <node name="n" ns="robot" pkg="pkg" type="ends.py" respawn="$(arg again)" cwd="node"/></launch>""",
    )
    write(pytester, "gone.launch", "<launch><node name='n' pkg='pkg' type='gone.py'/></launch>")
    write(
        pytester,
        "test_nodes.py",
        """
        from pathlib import Path

        def test_respawn(ros_launch, ros_wait_until):
            Path("ends").touch()
            launched = ros_launch("nodes.launch", again=True)
            ros_wait_until(lambda: Path("ends").read_text().count("ended") >= 3, 60, what="three ends")
            launched.stop()
            assert launched.running == ()

        def test_exit_code(ros_launch, ros_wait_until):
            launched = ros_launch("nodes.launch", again=False)
            ros_wait_until(lambda: launched.exit_codes, 60)
            assert launched.exit_codes == {"/robot/n": 3}

        def test_gone(ros_launch):
            ros_launch("gone.launch")

        def test_wait(ros_wait_until):
            ros_wait_until(lambda: None, timeout_s=0.05, what="a miracle")
        """,
    )

    result = run("test_nodes.py")

    result.assert_outcomes(passed=2, failed=2)
    result.stdout.fnmatch_lines(
        ["*NodesDidNotStart: cannot start n;*", "E       Failed: waited 0.05 s for a miracle"]
    )


def test_pipros_is_not_imported_before_a_test_uses_it(run: Run, pytester: pytest.Pytester) -> None:
    (pytester.path / "level.test").unlink()
    write(
        pytester,
        "test_plain.py",
        """
        import sys

        def test_it():
            used = {name for name in sys.modules if name.startswith("pipros.")}
            at_start = {"pipros.startup", "pipros.msg", "pipros.msg.importing", "pipros.msg.importing.hook"}
            assert used - at_start == {"pipros.testing", "pipros.testing.pytest_plugin"}
            # From 3.14 on Python's debugger, which pytest imports, brings it.
            assert "asyncio" not in sys.modules or sys.version_info >= (3, 14)
        """,
    )

    # The plugin of anyio looks for packages that are not installed, which pipros answers.
    run("-p", "no:anyio", "test_plain.py").assert_outcomes(passed=1)


def test_the_plugin_is_found_by_its_entry_point() -> None:
    from importlib.metadata import entry_points

    (found,) = entry_points(group="pytest11", name="pipros")

    assert found.value == "pipros.testing.pytest_plugin"
    assert Path(sys.modules[found.load().__name__].__file__ or "").name == "pytest_plugin.py"


@pytest.mark.parametrize("words", [(), ("-n", "2")], ids=["one process", "pytest-xdist"])
def test_the_junit_file_has_each_case_of_a_launch_file(
    run: Run, pytester: pytest.Pytester, words: tuple[str, ...]
) -> None:
    write(pytester, "test_plain.py", "def test_plain(): pass\n")

    result = run("--junitxml", "results.xml", "--ros-arg=level:=3", *words)

    result.assert_outcomes(passed=1, failed=2)
    (suite,) = ElementTree.parse(pytester.path / "results.xml").getroot()  # noqa: S314
    cases = {
        (case.get("classname"), case.get("name")): [child.tag for child in case if child.tag != "system-out"]
        for case in suite.iter("testcase")
    }
    assert cases == {
        ("level.test.first.__main__.T", "test_level"): ["failure"],
        ("level.test.first.__main__.T", "test_nothing"): [],
        ("level.test.second.__main__.T", "test_level"): ["failure"],
        ("level.test.second.__main__.T", "test_nothing"): [],
        ("test_plain", "test_plain"): [],
    }
    assert [suite.get(count) for count in ("tests", "failures", "errors")] == ["5", "2", "0"]
    messages = [failure.get("message") for failure in suite.iter("failure")]
    assert messages == ["3 != 25 : the level is wrong"] * 2
