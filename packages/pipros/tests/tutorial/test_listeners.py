"""Talkers and listeners, started, ended and killed in any order, and without a build."""

import signal
from pathlib import Path

import pytest

from tests.support.environments import EXAMPLES
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until
from tests.tutorial.words import HEARD, SAID

# Talkers and listeners that are started, ended and killed in any order.


def talker(ros: RosSystem) -> Process:
    return ros.pipros.start("rosrun", "composiv_tryouts", "composiv_talker.py")


def listener(ros: RosSystem, *arguments: str) -> Process:
    return ros.pipros.start("rosrun", "composiv_tryouts", "composiv_listener.py", *arguments)


def wait_for_new_message(subscriber: Process) -> None:
    subscriber.wait_for(HEARD, since=subscriber.mark())


def test_the_end_of_one_listener_does_not_affect_the_other(ros: RosSystem) -> None:
    ros.serve_master()
    one, two = listener(ros), listener(ros, "__name:=second")
    publisher = talker(ros)
    one.wait_for(HEARD)
    two.wait_for(HEARD)

    one.kill()
    one.wait()

    wait_for_new_message(two)
    assert "Traceback" not in publisher.output


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_a_listener_receives_from_the_successor_of_a_talker(ros: RosSystem, how: signal.Signals) -> None:
    ros.serve_master()
    subscriber = listener(ros)
    first = talker(ros)
    subscriber.wait_for(HEARD)

    first.send_signal(how)
    first.wait()
    talker(ros)

    wait_for_new_message(subscriber)
    subscriber.press_ctrl_c()
    subscriber.check(0)


def test_nodes_continue_without_roscore_and_still_end_on_ctrl_c(ros: RosSystem) -> None:
    core = ros.pipros.start_master()
    publisher, subscriber = talker(ros), listener(ros)
    subscriber.wait_for(HEARD)

    core.press_ctrl_c(code=0)

    wait_for_new_message(subscriber)
    for node in (publisher, subscriber):
        node.press_ctrl_c()
        node.check(0)


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_nodes_exit_with_0_and_without_a_traceback(ros: RosSystem, how: signal.Signals) -> None:
    ros.serve_master()
    publisher, subscriber = talker(ros), listener(ros)
    subscriber.wait_for(HEARD)

    for node in (publisher, subscriber):
        node.send_signal(how)
        node.check(0)
    wait_until(lambda: not ros.publishers("/battery_topic"), what="the end of the publisher's registration")
    wait_until(lambda: not ros.subscribers("/battery_topic"), what="the end of the subscriber's registration")


# `from composiv_tryouts.msg import BatteryLevel` works without a build in every kind of script.


SCRIPTS = EXAMPLES / "composiv_tryouts" / "scripts"


@pytest.mark.parametrize("lines", [
    "from composiv_tryouts.msg import BatteryLevel",
    "import composiv_tryouts.msg; BatteryLevel = composiv_tryouts.msg.BatteryLevel",
    "import rospy; from composiv_tryouts.msg import BatteryLevel", "from composiv_tryouts.msg import *",
])  # fmt: skip
def test_a_message_can_be_imported_on_the_first_line_of_a_script(ros: RosSystem, lines: str) -> None:
    script = ros.home / "script.py"
    script.write_text(f"{lines}\nprint(BatteryLevel._md5sum, BatteryLevel(battery='%25'))\n")

    ended = ros.pipros.run("python3", script)

    assert ended.stdout == ['cb6d55cbf4a366bc603a59ea79320b82 battery: "%25"'], ended.output


def test_plain_python_runs_the_nodes_too(ros: RosSystem) -> None:
    ros.serve_master()

    ros.pipros.start("python3", SCRIPTS / "composiv_talker.py").wait_for(SAID)
    ros.pipros.start("python3", SCRIPTS / "composiv_listener.py").wait_for(HEARD)


def test_nothing_is_written_into_the_package(ros: RosSystem, own_copy: Path) -> None:
    before = sorted(own_copy.rglob("*"))

    ended = ros.pipros.run("rostest", "composiv_tryouts", "composiv_tryout.launch")

    assert ended.returncode == 0, ended.output
    assert sorted(own_copy.rglob("*")) == before


def test_a_changed_definition_is_seen_at_the_next_start(ros: RosSystem, own_copy: Path) -> None:
    command = ("python3", "-c", "from composiv_tryouts.msg import BatteryLevel as B; print(B.__slots__)")
    assert ros.pipros.run(*command).stdout == ["['battery']"]

    (own_copy / "msg" / "BatteryLevel.msg").write_text("string battery\nuint8 percent\n")

    assert ros.pipros.run(*command).stdout == ["['battery', 'percent']"]


@pytest.mark.parametrize(("text", "named"), [
    ("string", "BatteryLevel.msg:1"), ("string battery\nstrin g\n", "BatteryLevel.msg:2"), ("a/b/c d", ":1"),
])  # fmt: skip
def test_a_definition_with_an_error_is_reported_with_its_line(
    ros: RosSystem, own_copy: Path, text: str, named: str
) -> None:
    (own_copy / "msg" / "BatteryLevel.msg").write_text(text)

    ended = ros.pipros.run("python3", "-c", "from composiv_tryouts.msg import BatteryLevel")

    assert ended.returncode == 1
    assert named in ended.stderr[-1] + "\n".join(ended.stderr[-4:])


def test_importing_an_unknown_message_raises_an_import_error_with_the_known_ones(ros: RosSystem) -> None:
    ended = ros.pipros.run("python3", "-c", "from composiv_tryouts.msg import BatteryLevell")

    assert ended.returncode == 1
    assert "ImportError" in ended.stderr[-1]
    assert "BatteryLevell" in ended.stderr[-1]
