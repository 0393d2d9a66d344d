"""rostest with real nodes and masters: start, supervision, interruption and clean-up."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

import rostest
from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from tests.support.environments import REPOSITORY
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

TEST = """#!/usr/bin/env python3
import os, unittest
import rostest, rospy
from tests.support.waiting import wait_until

class T(unittest.TestCase):
    def test_it(self):
        {body}

if __name__ == "__main__":
    rostest.rosrun("pkg", "t", T)
"""
STAYS = "#!/usr/bin/env python3\nimport signal\nsignal.pause()\n"
ENDS = "#!/usr/bin/env python3\nimport os\nopen(os.environ['ENDED'], 'a').write('ended\\n')\n"
WAITS = "open('started', 'w').close(); import signal; signal.pause()"


@pytest.fixture
def package(ros: RosSystem) -> Path:
    folder = ros.home / "ws" / "pkg"
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>pkg</name></package>")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(folder.parent)
    ros.pipros.environment["PYTHONPATH"] = str(REPOSITORY)
    write(folder, "stays.py", STAYS)
    write(folder, "ends.py", ENDS)
    return folder


def write(package: Path, name: str, content: str) -> None:
    (package / name).write_text(content)
    (package / name).chmod(0o755)


def write_test(package: Path, body: str, *, nodes: str = "", attributes: str = "") -> None:
    write(package, "t.py", TEST.format(body=body))
    test = f'<test test-name="t" pkg="pkg" type="t.py" {attributes}/>'
    write(package, "t.test", f"<launch>{nodes}{test}</launch>")


def test_arguments_of_the_command_line_reach_the_launch_file(ros: RosSystem, package: Path) -> None:
    write(package, "t.py", TEST.format(body="self.assertEqual(rospy.get_param('/level'), 25)"))
    write(
        package,
        "t.test",
        '<launch><arg name="level"/><param name="level" value="$(arg level)"/>'
        '<test test-name="t" pkg="pkg" type="t.py"/></launch>',
    )

    assert ros.pipros.run("rostest", "pkg", "t.test", "level:=25").returncode == 0
    unset = ros.pipros.run("rostest", "pkg", "t.test")
    assert unset.returncode == 1
    assert "requires the 'level' arg to be set" in unset.output


@pytest.mark.parametrize(
    ("attributes", "name"),
    [('name="a"', "/a"), ('name="a" ns="deep"', "/deep/a"), ('name=""', "/t"), ("", "/t")],
)
def test_the_name_of_a_test_is_that_of_its_node_and_test_name_that_of_its_results(
    ros: RosSystem, package: Path, attributes: str, name: str
) -> None:
    body = (
        f"rospy.init_node('own'); self.assertEqual((rospy.get_name(), rospy.get_param('~p')), ({name!r}, 5))"
    )
    write(package, "t.py", TEST.format(body=body))
    param = '<param name="p" value="5"/>'
    write(
        package,
        "t.test",
        f'<launch><test test-name="t" pkg="pkg" type="t.py" {attributes}>{param}</test></launch>',
    )
    ended = ros.pipros.run("rostest", "pkg", "t.test")
    assert ended.returncode == 0, ended.output
    assert list(Path(ros.pipros.environment["ROS_HOME"]).rglob("rosunit-t.xml"))


def test_two_runs_at_once_do_not_see_each_other(ros: RosSystem, package: Path) -> None:
    write_test(
        package,
        "name = os.environ['NAME']; rospy.set_param('/name', name); open(f'../{name}', 'w').close(); "
        "wait_until(lambda: os.path.exists('../a') and os.path.exists('../b')); "
        "self.assertEqual(rospy.get_param('/name'), name)",
    )

    runs = [
        ros.pipros.start("rostest", "pkg", "t.test", ROS_HOME=str(ros.home / f"home_{name}"), NAME=name)
        for name in "ab"
    ]

    assert [run.wait() for run in runs] == [0, 0], [run.output for run in runs]


def test_a_respawning_node_is_restarted_while_the_test_runs(ros: RosSystem, package: Path) -> None:
    ended = ros.home / "ended"
    write_test(
        package,
        f"wait_until(lambda: open({str(ended)!r}).read().count('ended') >= 3)",
        nodes='<node name="n" pkg="pkg" type="ends.py" respawn="true">'
        f'<env name="ENDED" value="{ended}"/></node>',
    )
    ended.touch()

    run = ros.pipros.run("rostest", "pkg", "t.test")

    assert run.returncode == 0, run.output


def test_the_end_of_a_required_node_ends_the_test_with_an_error(ros: RosSystem, package: Path) -> None:
    write_test(
        package,
        WAITS,
        nodes='<node name="n" pkg="pkg" type="ends.py" required="true">'
        '<env name="ENDED" value="/dev/null"/></node>',
    )

    run = ros.pipros.run("rostest", "pkg", "t.test")

    assert run.returncode == 1
    assert "ERROR: a required node exited before the test [t] ended" in run.stdout


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_ends_everything_and_does_not_look_like_a_passed_one(
    ros: RosSystem, package: Path, how: signal.Signals
) -> None:
    write_test(package, WAITS, nodes='<node name="n" pkg="pkg" type="stays.py"/>')
    run = ros.pipros.start("rostest", "pkg", "t.test")
    wait_until((ros.home / ".ros/started").exists, 60, "the test to run")

    run.send_signal(how)

    assert run.wait() == 130
    assert "SUCCESS" not in run.output
    assert run.stderr[-1] == "rostest was interrupted: no results"
    assert not list((ros.home / ".ros/test_results").rglob("rostest-*.xml"))
    ros.pipros.processes.assert_nothing_left()


def test_a_retry_passes_on_a_fresh_master(ros: RosSystem, package: Path) -> None:
    first = ros.home / "first"
    write_test(
        package,
        f"is_first = not os.path.exists({str(first)!r}); open({str(first)!r}, 'w').close(); "
        "self.assertFalse(rospy.has_param('/left')); rospy.set_param('/left', 1); self.assertFalse(is_first)",
        attributes='retry="1"',
    )

    run = ros.pipros.run("rostest", "pkg", "t.test")

    assert run.returncode == 0, run.output
    assert " * TESTS: 1" in run.stdout


def test_a_master_can_be_reused_with_and_without_the_parameters_of_others(
    ros: RosSystem, package: Path
) -> None:
    write_test(package, "self.assertEqual(rospy.get_param('/of_others', 'none'), os.environ['EXPECTED'])")
    with Master(host="127.0.0.1", port=ros.port) as master:
        client = MasterClient(master.uri, "/a_test")
        client.set_param("/of_others", "kept")
        client.set_param("/run_id", "the-run")

        kept = ros.pipros.run("rostest", "-r", "pkg", "t.test", EXPECTED="kept")
        cleared = ros.pipros.run("rostest", "-r", "-c", "pkg", "t.test", EXPECTED="none")

        assert (kept.returncode, cleared.returncode) == (0, 0), kept.output + cleared.output
        assert client.get_param("/run_id") == "the-run"
        client.close()


def test_a_folder_for_results_that_cannot_be_written_is_named(ros: RosSystem, package: Path) -> None:
    write_test(package, "pass")
    blocked = ros.home / "blocked"
    blocked.write_text("a file, no folder")

    run = ros.pipros.run("rostest", "pkg", "t.test", ROS_TEST_RESULTS_DIR=str(blocked))

    assert run.returncode == 1
    assert str(blocked) in run.stderr[-1]
    assert "Traceback" not in run.output


def test_a_file_outside_of_all_packages_needs_a_package_for_its_results(
    ros: RosSystem, package: Path
) -> None:
    write_test(package, "pass")
    outside = ros.home / "outside.test"
    outside.write_text((package / "t.test").read_text())

    refused = ros.pipros.run("rostest", str(outside))
    named = ros.pipros.run("rostest", "--package=pkg", f"--pkgdir={package}", str(outside))

    assert refused.returncode == 1
    assert "is not inside a ROS package" in refused.stderr[-1]
    assert named.returncode == 0
    name = str(outside.with_suffix("")).replace("/", "_")  # as genuine rostest names it
    assert (ros.home / f".ros/test_results/pkg/rostest-{name}.xml").exists()


def test_publishers_and_subscribers_can_be_queried(monkeypatch: pytest.MonkeyPatch) -> None:
    with Master(host="127.0.0.1", port=0) as master:
        monkeypatch.setenv("ROS_MASTER_URI", master.uri)
        client = MasterClient(master.uri, "/robot/talker")
        client.register_publisher("/level", "std_msgs/String", "http://127.0.0.1:1/")
        client.close()

        assert rostest.is_publisher("/level", "/robot/talker")
        assert rostest.is_publisher("level", "robot/talker")
        assert not rostest.is_publisher("/level", "/other")
        assert not rostest.is_publisher("/other", "/robot/talker")
        assert not rostest.is_subscriber("/level", "/robot/talker")
        with rostest.get_master() as proxy:
            assert proxy.getPid("/a_test")[0] == 1


def test_without_a_master_queries_fail() -> None:
    with pytest.raises(ConnectionError, match="roscore"):
        rostest.is_publisher("/level", "/talker")
