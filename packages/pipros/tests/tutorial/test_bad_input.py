"""Errors shown to a user: they name the problem and the file or node, without a traceback of pipros."""

import re
from pathlib import Path

import pytest

from tests.support.processes import INTERRUPTED, Process
from tests.support.ros import RosSystem
from tests.tutorial.words import SAID

BATTERY_LEVEL_MD5 = "cb6d55cbf4a366bc603a59ea79320b82"
STRING_MD5 = "992ce8a1687cec8c8bd883ec73ca41d1"


@pytest.fixture
def core(ros: RosSystem) -> None:
    ros.serve_master()


def edit(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def start_talker(ros: RosSystem) -> Process:
    return ros.pipros.start("rosrun", "composiv_tryouts", "composiv_talker.py")


def test_ctrl_c_ends_a_node_that_waits_for_its_master_at_once(ros: RosSystem) -> None:
    node = ros.pipros.start("rosrun", "composiv_tryouts", "composiv_listener.py")
    node.wait_for("Will keep trying")

    node.press_ctrl_c()

    node.check(INTERRUPTED)


@pytest.mark.usefixtures("core")
def test_an_illegal_topic_name_is_warned_about_and_refused(ros: RosSystem, own_copy: Path) -> None:
    edit(own_copy / "scripts/composiv_talker.py", '"battery_topic"', '"battery topic"')

    talker = start_talker(ros)

    talker.wait_for("UserWarning: 'battery topic' is not a legal ROS graph resource name")
    talker.wait_for(
        r"\[FATAL\] \[[\d.]+\]: unable to register publication \[/battery topic\] with master: "
        r"ERROR: parameter \[topic\] contains illegal chars"
    )
    talker.wait_for(SAID)


@pytest.mark.usefixtures("core")
def test_an_illegal_node_name_is_warned_about(ros: RosSystem, own_copy: Path) -> None:
    edit(own_copy / "scripts/composiv_talker.py", '"talker_node"', '"talker node"')

    talker = start_talker(ros)

    talker.wait_for("UserWarning: 'talker node' is not a legal ROS base name")
    talker.wait_for(SAID)


@pytest.mark.usefixtures("core")
def test_a_node_name_with_a_namespace_is_a_value_error(ros: RosSystem, own_copy: Path) -> None:
    edit(own_copy / "scripts/composiv_talker.py", '"talker_node"', '"robot/talker"')

    talker = start_talker(ros)

    assert talker.wait() == 1
    assert talker.stderr[-1] == "ValueError: namespaces are not allowed in node names"


@pytest.mark.usefixtures("core")
def test_a_wrong_message_type_is_explained_with_both_md5s(ros: RosSystem, own_copy: Path) -> None:
    listener = own_copy / "scripts/composiv_listener.py"
    edit(listener, "from composiv_tryouts.msg import BatteryLevel", "from std_msgs.msg import String")
    edit(listener, "BatteryLevel, subsCallback", "String, subsCallback")
    ros.pipros.start("rosrun", "composiv_tryouts", "composiv_listener.py")

    talker = start_talker(ros)

    found = talker.wait_for(r"\[WARN\] \[[\d.]+\]: (.*/listener_node.*)")
    for named in ("/battery_topic", "std_msgs/String", STRING_MD5, BATTERY_LEVEL_MD5):
        assert named in found[1]
    talker.wait_for(SAID, since=talker.mark())


@pytest.mark.usefixtures("core")
def test_a_definition_that_differs_under_the_same_name_is_explained_with_both_md5s(
    ros: RosSystem, own_copy: Path, tmp_path: Path
) -> None:
    start_talker(ros).wait_for(SAID)
    edit(own_copy / "msg/BatteryLevel.msg", "string battery", "string battery\nuint8 percent")
    percent_md5 = "[0-9a-f]{32}"

    listener = ros.pipros.start("rosrun", "composiv_tryouts", "composiv_listener.py")

    found = listener.wait_for(
        rf"{BATTERY_LEVEL_MD5}.*\b({percent_md5})\b|\b({percent_md5})\b.*{BATTERY_LEVEL_MD5}"
    )
    assert (found[1] or found[2]) != BATTERY_LEVEL_MD5


def test_roslaunch_starts_other_nodes_if_a_script_is_not_executable(ros: RosSystem, own_copy: Path) -> None:
    (own_copy / "scripts/composiv_talker.py").chmod(0o644)

    launch = ros.pipros.start("roslaunch", "composiv_tryouts", "composiv_tryout.launch")

    launch.wait_for(r"process\[listener-\d\]: started with pid")
    error = (
        "ERROR: cannot launch node of type [composiv_tryouts/composiv_talker.py]: Cannot locate node of type "
        "[composiv_talker.py] in package [composiv_tryouts]. Make sure file exists in package path and "
        "permission is set to executable (chmod +x)"
    )
    launch.wait_for(re.escape(error))  # on another stream, so it may appear later


@pytest.mark.parametrize(("file", "report"), [
    ("test/test_talker.py",
        "Test node [composiv_tryouts/test_talker.py] does not exist or is not executable"),
    ("scripts/composiv_talker.py", "There is FOLDER/scripts/composiv_talker.py"),
])  # fmt: skip
def test_a_script_that_is_not_executable_makes_rostest_fail(
    ros: RosSystem, own_copy: Path, file: str, report: str
) -> None:
    (own_copy / file).chmod(0o644)

    ended = ros.pipros.run("rostest", "composiv_tryouts", "composiv_tryout.launch")

    ended.check(1, report.replace("FOLDER", str(own_copy)))
    assert "ERROR: The following tests failed to run:" in ended.stdout
    assert " * testtest_talker" in ended.stdout


def test_a_test_with_a_damaged_main_guard_did_not_generate_results(ros: RosSystem, own_copy: Path) -> None:
    edit(own_copy / "test/test_talker.py", "'__main__'", "' main '")

    ended = ros.pipros.run("rostest", "composiv_tryouts", "composiv_tryout.launch")

    ended.check(1, "test [test_talker] did not generate test results")


def test_a_test_beyond_its_time_limit_is_ended_and_reported(ros: RosSystem, own_copy: Path) -> None:
    edit(own_copy / "launch/composiv_tryout.launch", "<test ", '<test time-limit="0.5" ')

    ended = ros.pipros.run("rostest", "composiv_tryouts", "composiv_tryout.launch")

    assert ended.returncode == 1
    assert (
        "ERROR: max time [0.5s] allotted for test [test_talker] of type [composiv_tryouts/test_talker.py]"
    ) in ended.stdout


@pytest.mark.parametrize(("command", "code", "report"), [
    ("rosrun composiv_tryout composiv_talker.py", 2, "[rospack] Error: package 'composiv_tryout' not found"),
    ("rosrun composiv_tryouts composiv_talker", 3,
        "[rosrun] Couldn't find executable named composiv_talker below "),
    ("roslaunch composiv_tryouts nope.launch", 1,
        "[nope.launch] is neither a launch file in package [composiv_tryouts] nor is [composiv_tryouts] "
        "a launch file name"),
    ("roslaunch composiv_tryout composiv_tryout.launch", 1,
        "[composiv_tryout.launch] is neither a launch file in package [composiv_tryout] nor is "
        "[composiv_tryout] a launch file name"),
    ("rostest composiv_tryouts nope.launch", 1,
        "[nope.launch] is neither a launch file in package [composiv_tryouts] nor is [composiv_tryouts] "
        "a launch file name"),
])  # fmt: skip
def test_a_name_that_does_not_exist_is_named(ros: RosSystem, command: str, code: int, report: str) -> None:
    ended = ros.pipros.run(*command.split())

    ended.check(code, report)
    assert "Traceback" not in ended.output.replace("The traceback for the exception was written", "")
