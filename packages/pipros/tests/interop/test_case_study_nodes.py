"""The case study's nodes with genuine peers, and with either master."""

import re
import signal

import pytest

from tests.support.processes import Process
from tests.support.ros import RosSystem, Side
from tests.support.waiting import wait_until

SAID = r"\[INFO\] \[\d+\.\d+\]: %25"
HEARD = r"\[INFO\] \[\d+\.\d+\]: Battery level of vehicle: %(\d+)"


@pytest.fixture(params=["genuine master", "pipros master"])
def master(request: pytest.FixtureRequest, ros: RosSystem) -> None:
    start_master(ros, request.param.removesuffix(" master"))


def start_master(ros: RosSystem, name: str) -> None:
    if name == "genuine":
        ros.genuine.start_bare_master()
    else:
        ros.serve_master()


def side(ros: RosSystem, name: str) -> Side:
    return ros.genuine if name == "genuine" else ros.pipros


def talker(side: Side) -> Process:
    return side.start_node("composiv_tryouts", "composiv_talker.py")


def listener(side: Side) -> Process:
    return side.start_node("composiv_tryouts", "composiv_listener.py")


@pytest.mark.usefixtures("master")
@pytest.mark.parametrize(("talking", "listening"), [("genuine", "pipros"), ("pipros", "genuine")])
def test_talker_and_listener_connect_in_either_order_and_again_after_a_restart(
    ros: RosSystem, talking: str, listening: str
) -> None:
    heard = listener(side(ros, listening))
    ros.wait_for_subscriber("/battery_topic")
    for how in (signal.SIGINT, signal.SIGKILL):  # one talker ends, the other is killed
        said = talker(side(ros, talking))
        hears(heard)
        said.send_signal(how)
        assert said.wait() == (0 if how == signal.SIGINT else -how)
        assert "Traceback" not in said.output
    said = talker(side(ros, talking))
    hears(heard)
    for process in (said, heard):
        process.press_ctrl_c()
        process.check(0)


# Not with both from genuine ROS: there, the new listener sometimes gets the request meant for the old one.
@pytest.mark.parametrize(
    ("mastering", "listening"), [("genuine", "pipros"), ("pipros", "genuine"), ("pipros", "pipros")]
)
def test_a_new_listener_ends_an_older_one_of_the_same_name(ros, mastering: str, listening: str) -> None:
    start_master(ros, mastering)
    said = talker(ros.pipros)
    heard = listener(side(ros, listening))
    hears(heard)

    late = listener(side(ros, listening))
    hears(late)
    assert heard.wait() == 0
    for process in (said, late):
        process.press_ctrl_c()
        assert process.wait() == 0
    for process in (said, late, heard):
        assert "Traceback" not in process.output


def hears(heard: Process) -> None:
    """Wait until a listener receives two further messages."""
    mark = heard.mark()
    heard.wait_for(HEARD, since=mark)
    mark = heard.mark()
    heard.wait_for(HEARD, since=mark)


@pytest.mark.usefixtures("master")
def test_genuine_tools_see_a_pipros_node_as_one_of_their_own(ros: RosSystem) -> None:
    talker(ros.pipros).wait_for(SAID)
    heard = listener(ros.genuine)
    heard.wait_for(HEARD)

    echoed = ros.genuine.run("rostopic", "echo", "-n", "1", "/battery_topic")
    info = ros.genuine.run("rosnode", "info", "/talker_node")
    ping = ros.genuine.run("rosnode", "ping", "-c", "1", "/talker_node")

    assert echoed.stdout == ['battery: "%25"', "---"]
    assert [line.rstrip() for line in info.stdout] == [
        "-" * 80, "Node [/talker_node]", "Publications:", " * /battery_topic [composiv_tryouts/BatteryLevel]",
        " * /rosout [rosgraph_msgs/Log]", "", "Subscriptions: None", "", "Services:",
        " * /talker_node/get_loggers", " * /talker_node/set_logger_level", "", "",
        _like(info.stdout, r"contacting node http://127\.0\.0\.1:\d+/ \.\.\."),
        _like(info.stdout, r"Pid: \d+"), "Connections:", *_connections(info.stdout), "",
    ]  # fmt: skip
    assert any("/listener_node" in line for line in _connections(info.stdout))
    assert ping.returncode == 0
    assert re.search(r"xmlrpc reply from http://.+\ttime=", ping.output)


@pytest.mark.usefixtures("master")
def test_a_pipros_listener_gets_every_message_of_a_roscpp_talker_in_order(ros: RosSystem) -> None:
    heard = listener(ros.pipros)
    ros.wait_for_subscriber("/battery_topic")
    ros.genuine.start_node("cpp_battery", "battery_talker")

    levels = wait_until(lambda: _levels(heard, at_least=60), 60, what=lambda: heard.output)

    assert levels == list(range(levels[0], levels[0] + len(levels)))


@pytest.mark.usefixtures("master")
def test_a_roscpp_listener_gets_messages_and_the_name_of_a_pipros_talker(ros: RosSystem) -> None:
    said = talker(ros.pipros)
    heard = ros.genuine.start_node("cpp_battery", "battery_listener")

    heard.wait_for(r"^heard %25 from /talker_node$")
    said.press_ctrl_c()
    assert said.wait() == 0
    mark = heard.mark()
    talker(ros.pipros)
    heard.wait_for(r"^heard %25 from /talker_node$", since=mark)


def _levels(heard: Process, at_least: int) -> list[int]:
    levels = [int(found[1]) for line in list(heard.lines) if (found := re.search(HEARD, line))]
    return levels if len(levels) >= at_least else []


def _like(lines: list[str], pattern: str) -> str:
    """Return the line that matches the pattern, else the pattern, so that a comparison shows it."""
    return next((line for line in lines if re.fullmatch(pattern, line)), pattern)


def _connections(lines: list[str]) -> list[str]:
    return [
        line.rstrip() for line in lines[lines.index("Connections:") + 1 :] if line.startswith((" *", "    *"))
    ]
