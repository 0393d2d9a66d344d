"""Section 4.5 of the case study: the launch file, run by roslaunch and by rostest."""

import re
import shutil
from pathlib import Path

import pytest

from tests.support import documents
from tests.support.environments import EXAMPLES
from tests.support.reading import assert_in_order
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until
from tests.tutorial.words import CORE_IS_UP, FAILED_ROSTEST, HEARD, LAUNCH, PASSED_ROSTEST, ROSTEST, SAID


def test_roslaunch_starts_a_master_and_the_two_nodes_without_the_test(ros: RosSystem) -> None:
    launch, look = ros.pipros.open_terminal(), ros.pipros.open_terminal()

    launch.type(LAUNCH)
    launch.wait_for(r"process\[listener-3\]: started with pid \[\d+\]")
    ros.wait_for_publisher("/battery_topic")

    wait_until(
        lambda: look.run("rosnode list")[1] == "/listener\n/rosout\n/talker\n",
        what=lambda: f"the two nodes: {look.output}",
    )
    launch.press_ctrl_c()
    assert launch.wait_for_prompt() == 0
    assert_in_order(
        launch.output,
        [
            rf"^\.\.\. logging to {ros.home}/\.ros/log/[0-9a-f-]{{36}}/roslaunch-.+-\d+\.log$",
            r"^Press Ctrl-C to interrupt$", r"^\x1b\]2;.+/launch/composiv_tryout\.launch\x07$",
            r"^\x1b\[1mstarted roslaunch server http://.+/\x1b\[0m$", r"^SUMMARY$", r"^PARAMETERS$",
            r"^ \* /rosdistro: noetic$", r"^ \* /rosversion: 1\.1[56]\.\d+$", r"^NODES$", r"^  /$",
            r"^    listener \(composiv_tryouts/composiv_listener\.py\)$",
            r"^    talker \(composiv_tryouts/composiv_talker\.py\)$", r"^auto-starting new master$",
            rf"^\x1b\[1mROS_MASTER_URI=http://[^ ]+:{ros.port}/?\x1b\[0m$",
            r"^\x1b\[1msetting /run_id to [0-9a-f-]{36}\x1b\[0m$", r"^started core service \[/rosout\]$",
            r"^\x1b\[1mprocess\[talker-2\]: started with pid \[\d+\]\x1b\[0m$",
            r"^\x1b\[1mprocess\[listener-3\]: started with pid \[\d+\]\x1b\[0m$",
            r"composiv_talker\.py:8: SyntaxWarning: The publisher should be created with an explicit keyword",
            r"^(\^C)?\[listener-3\] killing on exit$", r"^(\x1b\[0m)?\[talker-2\] killing on exit$",
            r"^(\^C|\x1b\[0m)*\[rosout-1\] killing on exit$", r"^(\x1b\[0m)?\[master\] killing on exit$",
            r"^shutting down processing monitor\.\.\.$",
            r"^\.\.\. shutting down processing monitor complete$", r"^\x1b\[1mdone\x1b\[0m$",
        ],
    )  # fmt: skip
    assert "test_talker" not in launch.output


def test_node_output_is_written_to_log_files(ros: RosSystem) -> None:
    launch = ros.pipros.open_terminal()

    launch.type(LAUNCH)
    wait_until(lambda: re.search(SAID, _log(ros, "talker-2-stdout.log")), 60, "the talker's log")
    wait_until(lambda: re.search(HEARD, _log(ros, "listener-3-stdout.log")), 60, "the listener's log")

    assert not re.search(SAID, launch.output)
    assert not re.search(HEARD, launch.output)


def test_with_screen_the_output_is_shown_live(ros: RosSystem) -> None:
    launch = ros.pipros.open_terminal()

    launch.type(f"{LAUNCH} --screen")

    launch.wait_for(SAID)
    launch.wait_for(HEARD)


def test_a_running_roscore_is_used_and_left_running(ros: RosSystem) -> None:
    core, launch, look = (ros.pipros.open_terminal() for _ in range(3))
    core.type("roscore")
    core.wait_for(CORE_IS_UP)
    ros.wait_for_publisher("/rosout_agg")

    launch.type(LAUNCH)
    launch.wait_for(r"process\[listener-2\]: started with pid")
    ros.wait_for_publisher("/battery_topic")
    ros.wait_for_subscriber("/battery_topic")
    launch.press_ctrl_c()

    assert launch.wait_for_prompt() == 0
    assert "auto-starting new master" not in launch.output
    wait_until(lambda: look.run("rosnode list") == (0, "/rosout\n"), what=lambda: look.output)


def test_rostest_passes_with_the_talker(ros: RosSystem) -> None:
    # Output of nodes on stderr would appear at once, between lines of the report; even a traceback of a
    # listener that is ended during its imports.
    code, output = ros.pipros.open_terminal().run(f"{ROSTEST} 2>of_nodes")

    assert code == 0, output
    assert re.search(r".+: SyntaxWarning: .+\n  pub = .+\n", (ros.home / "of_nodes").read_text())
    report = output.partition("[ROSUNIT]")[2]
    log = re.search(r"\.\.\. logging to (.+)\n", output)
    assert log
    assert report == (
        f" Outputting test results to {_results(ros)}/rostest-launch_composiv_tryout.xml\n"
        "[Testcase: testtest_talker] ... ok\n"
        f"\n{PASSED_ROSTEST}{log[1]}\n"
    )
    assert sorted(file.name for file in _results(ros).iterdir()) == [
        "rostest-launch_composiv_tryout.xml",
        "rosunit-test_talker.xml",
    ]


def test_rostest_fails_with_a_clear_report_without_the_talker(ros: RosSystem, own_copy: Path) -> None:
    launch_file = own_copy / "launch/composiv_tryout.launch"
    lines = launch_file.read_text().splitlines(keepends=True)
    launch_file.write_text("".join(line for line in lines if "composiv_talker.py" not in line))

    code, output = ros.pipros.open_terminal().run(ROSTEST)

    assert code == 2, output
    assert_in_order(output, FAILED_ROSTEST)
    outer = (_results(ros) / "rostest-launch_composiv_tryout.xml").read_text()
    assert '<testsuite errors="0" failures="0"' in outer


@pytest.mark.parametrize("command", [LAUNCH, ROSTEST])
def test_a_launch_file_that_is_no_xml_is_named_by_line(ros: RosSystem, own_copy: Path, command: str) -> None:
    launch_file = own_copy / "launch/composiv_tryout.launch"
    launch_file.write_text(launch_file.read_text().replace("</launch>", "<launch>"))
    end = len(launch_file.read_text().splitlines())

    code, output = ros.pipros.open_terminal().run(command)

    assert code == 1
    assert re.search(
        rf"{re.escape(str(launch_file))}:{end + 1}:\d+|{re.escape(str(launch_file))}:{end}:\d+", output
    )
    assert "Traceback" not in output


def test_the_loop_of_the_guide_grades_the_packages_of_a_class(ros: RosSystem, tmp_path: Path) -> None:
    for name in ("ana", "ben"):
        shutil.copytree(EXAMPLES / "composiv_tryouts", tmp_path / "handed" / name / "composiv_tryouts")
    talker = tmp_path / "handed/ben/composiv_tryouts/scripts/composiv_talker.py"
    talker.write_text(talker.read_text().replace("init_node(", "init_node(("))
    level = re.search(r"<!-- level.test -->\n(.*?)```", documents.text_of("guides/testing.md"), re.DOTALL)
    loop = re.search(r"for each in handed.*?\ndone", documents.text_of("guides/classroom.md"), re.DOTALL)
    assert level
    assert loop
    rate = r"(?s)  <test test-name=.comes_once.*?</test>\n"  # takes 20 s if nothing comes
    (tmp_path / "level.test").write_text(re.sub(rate, "", level[1]))

    ended = ros.pipros.run("bash", "-c", f"cd {tmp_path}\n{loop[0]}", timeout_s=120)

    assert ended.stdout == ["handed/ana/ passed", "handed/ben/ failed"], ended.output
    assert "SyntaxError" in (tmp_path / "handed/ben/log.txt").read_text()


def _results(ros: RosSystem) -> Path:
    return ros.home / ".ros/test_results/composiv_tryouts"


def _log(ros: RosSystem, name: str) -> str:
    return "".join(file.read_text() for file in (ros.home / ".ros/log").glob(f"*/{name}"))
