"""The pytest plugin in a separate pytest run: collected launch files, fixtures and failure reports."""

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
    "hzerror: 0.5, test_duration: 3.0": "hzerror: 0.9, test_duration: 6.0", "timeout: 10,": "timeout: 60,",
    "heard, what=": "heard, timeout_s=60, what=",
    "connection_count == 1, what=": "connection_count == 1, timeout_s=60, what=",
}  # fmt: skip
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
        plugin = ("-p", "no:pipros", "-p", "pipros_tools.testing.pytest_plugin")
        return pytester.runpytest_subprocess(*plugin, "-p", "no:cacheprovider", *words)

    return run_pytest


def write(pytester: pytest.Pytester, name: str, content: str) -> None:
    (pytester.path / name).write_text(textwrap.dedent(content))


def test_each_test_of_a_launch_file_is_an_item_and_leaves_no_results_behind(run: Run, pytester) -> None:
    result = run("-v")

    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(["level.test::first PASSED*", "level.test::second PASSED*"])
    assert not (pytester.path / ".ros/test_results").exists()


def test_a_launch_file_is_collected_when_it_has_tests_and_other_files_are_not(run: Run, pytester) -> None:
    write(pytester, "tests.launch", LAUNCH)
    write(pytester, "nodes.launch", "<launch><node name='n' pkg='pkg' type='t.py'/></launch>")
    write(pytester, "other.test", "a test of some other program")

    result = run("--collect-only", "-q")

    assert result.outlines[:4] == [
        "level.test::first", "level.test::second", "tests.launch::first", "tests.launch::second",
    ]  # fmt: skip
    assert "4 tests collected" in result.outlines[-1]


def test_a_failure_shows_the_text_of_the_test_program_and_none_of_our_frames(run: Run) -> None:
    result = run("level.test::first", "--ros-arg", "level:=26")

    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        [
            "*_ <test> first _*", "FAILURE: test_level (__main__.T)", "26 != 25 : the level is wrong",
            '  File "*/t.py", line 8, in test_level', "*- Captured stdout of first call -*",
            "this was printed", "FAILED level.test::first - *",
        ]
    )  # fmt: skip
    output = result.stdout.str()
    assert "Traceback" not in output
    assert "pipros_tools/testing" not in output
    assert "test_nothing" not in output


CANNOT_RUN = (
    (f"{TEST_OF}'pkg' type='gone.py'/>", "[pkg/gone.py] does not exist or is not executable"),
    (f"{TEST_OF}'gone' type='t.py'/>", "Package [gone] for test node [gone/t.py] does not exist"),
    (
        f"<node name='n' pkg='pkg' type='gone.py'/>{TEST_OF}'pkg' type='t.py'/>",
        "Test Fixture Nodes ['n'] failed to launch",
    ),
    (f"{TEST_OF}'pkg' type='stays.py' time-limit='0.3'/>", "max time [0.3s] allotted for test [t]"),
    (f"{TEST_OF}'pkg' type='silent.py'/>", "test [t] did not generate test results"),
)
"""Elements of launch files, and what their tests say."""


def test_a_test_that_cannot_run_says_why(run: Run, pytester: pytest.Pytester) -> None:
    (pytester.path / "level.test").unlink()
    for number, (element, _) in enumerate(CANNOT_RUN):
        write(pytester, f"case_{number}.test", f"<launch>{element}</launch>")
    for name, body in {"stays.py": "import signal; signal.pause()", "silent.py": ""}.items():
        write(pytester, name, f"#!/usr/bin/env python3\n{body}\n")
        (pytester.path / name).chmod(0o755)

    result = run()

    result.assert_outcomes(failed=len(CANNOT_RUN))
    reports = re.split(r"\n_+ <test> t _+\n", result.stdout.str().partition("= FAILURES =")[2])[1:]
    for report, (_, expected) in zip(reports, CANNOT_RUN, strict=True):
        said = report.partition("Captured")[0]
        assert expected in said
        assert "Traceback" not in said


def test_a_mistake_in_a_launch_file_is_an_error_of_collection(run: Run, pytester: pytest.Pytester) -> None:
    write(pytester, "level.test", '<launch>\n<test test-name="$(arg gone)" pkg="pkg" type="t.py"/></launch>')

    result = run()

    assert result.ret == pytest.ExitCode.INTERRUPTED
    output = result.stdout.str()
    assert "level.test:2" in output
    assert "gone" in output
    assert "Traceback" not in output


def test_the_examples_of_the_documentation_work(run: Run, pytester: pytest.Pytester) -> None:
    text = (REPOSITORY / "docs/guides/testing.md").read_text()
    examples = re.findall(r"```(?:python|xml)\n(?:# |<!-- )([\w.]+)(?: -->)?\n(.*?)```", text, re.DOTALL)
    for name, content in examples:
        for hasty, patient in PATIENT.items():
            content = content.replace(hasty, patient)
        write(pytester, name, content)

    result = run("-v")

    assert [name for name, _ in examples] == [
        "level.test", "test_battery.py", "listener.launch", "test_bad_network.py",
    ]  # fmt: skip
    result.assert_outcomes(passed=7)


def test_respawning_nodes_are_restarted_and_lacking_programs_named(run: Run, pytester) -> None:
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
            used = {name for name in sys.modules if name.startswith(("pipros.", "pipros_"))}
            at_start = {"pipros.startup", "pipros.msg", "pipros.msg.importing", "pipros.msg.importing.hook"}
            testing = {"pytest_plugin", "pytest_programs"}
            plugin = {f"pipros_tools.testing.{name}" for name in testing}
            assert used - at_start == {"pipros_tools", "pipros_tools.testing", *plugin}
            # From 3.14 on Python's debugger, which pytest imports, brings it.
            assert "asyncio" not in sys.modules or sys.version_info >= (3, 14)
        """,
    )

    # The plugin of anyio looks for packages that are not installed, which pipros answers.
    run("-p", "no:anyio", "test_plain.py").assert_outcomes(passed=1)


def test_the_plugin_is_found_by_its_entry_point() -> None:
    from importlib.metadata import entry_points

    (found,) = entry_points(group="pytest11", name="pipros")

    assert found.value == "pipros_tools.testing.pytest_plugin"
    assert Path(sys.modules[found.load().__name__].__file__ or "").name == "pytest_plugin.py"


@pytest.mark.parametrize("words", [(), ("-n", "2")], ids=["one process", "pytest-xdist"])
def test_the_junit_file_has_each_case_of_a_launch_file(run: Run, pytester, words: tuple[str, ...]) -> None:
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
        ("level.test.second.__main__.T", "test_nothing"): [], ("test_plain", "test_plain"): [],
    }  # fmt: skip
    assert [suite.get(count) for count in ("tests", "failures", "errors")] == ["5", "2", "0"]
    messages = [failure.get("message") for failure in suite.iter("failure")]
    assert messages == ["3 != 25 : the level is wrong"] * 2


@pytest.mark.parametrize(
    ("words", "outcomes"),
    [
        ((".",), {"passed": 1}), (("test",), {"failed": 1}), (("test/test_a.py",), {"failed": 1}),
        (("test/test_a.py", "zz/a.launch"), {"passed": 1}), ((".", "-k", "runs or a_test"), {"passed": 1}),
    ],
    ids=["folder", "folder without the launch file", "named", "pattern of the shell", "-k"],
)  # fmt: skip
def test_a_program_of_a_launch_file_is_left_out_and_fails_without_a_master(
    run: Run, pytester: pytest.Pytester, words: tuple[str, ...], outcomes: dict[str, int]
) -> None:
    (pytester.path / "level.test").unlink()
    for folder in ("test", "zz"):
        (pytester.path / folder).mkdir()
    write(pytester, "test/test_a.py", TEST.replace("print(", 'rospy.init_node("a"); print('))
    (pytester.path / "test/test_a.py").write_text(
        (pytester.path / "test/test_a.py").read_text().replace("def test_nothing", "def nothing")
    )
    (pytester.path / "test/test_a.py").chmod(0o755)
    write(
        pytester,
        "zz/a.launch",
        """<launch><param name="/level" value="25"/>
        <test test-name="a_test" pkg="pkg" type="test_a.py"/></launch>""",
    )

    result = run(*words)

    result.assert_outcomes(**outcomes)
    if "failed" in outcomes:
        result.stdout.fnmatch_lines(["*no master responded to pytest within 10 s*fixture ros_master*"])
    else:
        result.stdout.fnmatch_lines(["not collected: test/test_a.py, run by zz/a.launch"])


def test_programs_that_catkin_make_puts_in_devel_are_left_out(run: Run, pytester: pytest.Pytester) -> None:
    """In the folder of a workspace, `devel` and `install` have programs that run those in `src`."""
    (pytester.path / "level.test").unlink()
    for space in ("devel", "install"):
        programs = pytester.path / space / "lib" / "pkg"
        programs.mkdir(parents=True)
        (pytester.path / space / ".catkin").write_text("")
        (programs / "test_installed.py").write_text("import sys\n\nsys.exit(1)\n")
    write(pytester, "test_passes.py", "def test_it():\n    pass\n")

    run().assert_outcomes(passed=1)
    (pytester.path / "install" / "lib" / "pkg" / "test_installed.py").write_text("def test_it(): pass")
    run("install/lib/pkg/test_installed.py").assert_outcomes(passed=1)
    run("install").assert_outcomes(passed=1)


def test_waits_for_a_master_end_in_pytest(run: Run, pytester: pytest.Pytester) -> None:
    """Also if a program accepts connections at the master's address but does not respond."""
    write(
        pytester,
        "test_waits.py",
        """
        import socket, subprocess, sys
        import pytest, rospy
        from std_msgs.msg import String
        from std_srvs.srv import Empty

        @pytest.fixture(autouse=True)
        def master(request, monkeypatch):
            for name in ("missing_master.PYTEST_WAIT_S", "node.ANSWER_LIMIT_S"):
                monkeypatch.setattr(f"pipros.node.{name}", 0.5)
            with socket.create_server(("127.0.0.1", 0)) as listener:
                if "silent" not in request.node.name:
                    listener.close()
                    port = 1
                else:
                    port = listener.getsockname()[1]
                monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{port}")
                yield

        def check(wait, *words):
            with pytest.raises(rospy.ROSException) as caught:
                wait()
            for word in words:
                assert word in str(caught.value)

        ADVICE = ("no master responded to pytest within 0.5 s", "fixture ros_master")

        def test_wait_for_service():
            check(lambda: rospy.wait_for_service("/reset"), *ADVICE, "Connection refused")

        def test_wait_for_service_of_a_proxy():
            check(rospy.ServiceProxy("/reset", Empty).wait_for_service, *ADVICE)

        def test_wait_for_service_with_a_timeout():
            check(lambda: rospy.wait_for_service("/reset", timeout=0.8), "timeout exceeded")

        def test_wait_for_message():
            check(lambda: rospy.wait_for_message("/chatter", String), "/chatter", "init_node() was not")

        def test_init_node():
            check(lambda: rospy.init_node("a"), *ADVICE, "Connection refused")

        def test_init_node_with_a_silent_master():
            check(lambda: rospy.init_node("a"), *ADVICE, "no response in time")

        def test_a_program_that_pytest_starts_waits_as_long_as_ever():
            program = "from pipros.node.missing_master import pytest_wait_s; print(pytest_wait_s())"
            assert subprocess.check_output([sys.executable, "-c", program], text=True) == "None\\n"
        """,
    )

    run("test_waits.py").assert_outcomes(passed=7)
