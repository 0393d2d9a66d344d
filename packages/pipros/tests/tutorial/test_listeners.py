"""Talkers and listeners that are started, ended and killed in any order."""

from __future__ import annotations

import signal

import pytest

from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until
from tests.tutorial.words import HEARD, SAID


@pytest.fixture
def core(ros: RosSystem) -> Process:
    return ros.pipros.start_master()


def talker(ros: RosSystem) -> Process:
    return ros.pipros.start("rosrun", "composiv_tryouts", "composiv_talker.py")


def listener(ros: RosSystem, *arguments: str) -> Process:
    return ros.pipros.start("rosrun", "composiv_tryouts", "composiv_listener.py", *arguments)


def wait_for_new_message(subscriber: Process) -> None:
    subscriber.wait_for(HEARD, since=subscriber.mark())


@pytest.mark.usefixtures("core")
def test_a_listener_started_before_the_talker_receives_its_messages(ros: RosSystem) -> None:
    subscriber = listener(ros)
    ros.wait_for_subscriber("/battery_topic")

    talker(ros)

    subscriber.wait_for(HEARD)


@pytest.mark.usefixtures("core")
def test_a_listener_started_after_the_talker_receives_its_messages(ros: RosSystem) -> None:
    talker(ros).wait_for(SAID)

    subscriber = listener(ros)

    subscriber.wait_for(HEARD)


@pytest.mark.usefixtures("core")
def test_a_listener_receives_messages_again_after_a_restart_of_the_talker(ros: RosSystem) -> None:
    subscriber = listener(ros)
    first = talker(ros)
    subscriber.wait_for(HEARD)

    first.press_ctrl_c()
    assert first.wait() == 0
    talker(ros)

    wait_for_new_message(subscriber)


@pytest.mark.usefixtures("core")
def test_two_listeners_receive_from_the_same_talker(ros: RosSystem) -> None:
    one, two = listener(ros), listener(ros, "__name:=second")

    talker(ros)

    one.wait_for(HEARD)
    two.wait_for(HEARD)


@pytest.mark.usefixtures("core")
def test_the_end_of_one_listener_does_not_affect_the_other(ros: RosSystem) -> None:
    one, two = listener(ros), listener(ros, "__name:=second")
    publisher = talker(ros)
    one.wait_for(HEARD)
    two.wait_for(HEARD)

    one.kill()
    one.wait()

    wait_for_new_message(two)
    assert "Traceback" not in publisher.output


@pytest.mark.usefixtures("core")
def test_a_listener_receives_from_the_successor_of_a_talker_killed_with_sigkill(ros: RosSystem) -> None:
    subscriber = listener(ros)
    first = talker(ros)
    subscriber.wait_for(HEARD)

    first.send_signal(signal.SIGKILL)
    first.wait()
    talker(ros)

    wait_for_new_message(subscriber)
    subscriber.press_ctrl_c()
    assert subscriber.wait() == 0
    assert "Traceback" not in subscriber.output


def test_nodes_continue_without_roscore_and_still_end_on_ctrl_c(ros: RosSystem, core: Process) -> None:
    publisher, subscriber = talker(ros), listener(ros)
    subscriber.wait_for(HEARD)

    core.press_ctrl_c()
    assert core.wait() == 0

    wait_for_new_message(subscriber)
    for node in (publisher, subscriber):
        node.press_ctrl_c()
        assert node.wait() == 0
        assert "Traceback" not in node.output


@pytest.mark.usefixtures("core")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_nodes_exit_with_0_and_without_a_traceback(ros: RosSystem, how: signal.Signals) -> None:
    publisher, subscriber = talker(ros), listener(ros)
    subscriber.wait_for(HEARD)

    for node in (publisher, subscriber):
        node.send_signal(how)
        assert node.wait() == 0
        assert "Traceback" not in node.output
    wait_until(lambda: not ros.publishers("/battery_topic"), what="the end of the publisher's registration")
    wait_until(lambda: not ros.subscribers("/battery_topic"), what="the end of the subscriber's registration")
