"""rostopic with running nodes: echo, hz, bw, delay and pub, their output and how they exit."""

import itertools
import re
import shutil
import signal
import subprocess
from pathlib import Path

import pytest
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.time import Time
from pipros.net.master_client import MasterClient
from pipros.node import Publisher
from pipros_tools.graph.system_state import SystemState
from tests.support.nodes import Inbox, MakeNode, wait_until_connected
from tests.support.processes import Process
from tests.support.ros import Commands, RosSystem
from tests.support.slaves import FakeSlave
from tests.support.waiting import wait_until

# rostopic echo, hz, bw and delay with running nodes: their output and how they exit.


@pytest.fixture
def talker(make_node: MakeNode) -> Publisher:
    return make_node("talker").advertise("/chatter", String)


def test_echo_shows_messages_and_ends_after_the_requested_number(commands, talker: Publisher) -> None:
    echo = commands.start("rostopic", "echo", "-n", "2", "/chatter")
    wait_until_connected(talker)
    for word in ("one", "two", "three"):
        talker.publish(String(word))

    assert (echo.wait(), echo.stdout) == (0, ['data: "one"', "---", 'data: "two"', "---"])
    assert echo.stderr == []


def test_echo_shows_types_of_unknown_packages(commands: Commands, make_node: MakeNode) -> None:
    strange = message_classes_from_text(
        "strange_msgs/Pair", f"Part left\nPart right\n{'=' * 80}\nMSG: strange_msgs/Part\nint32 number\n"
    )
    left = strange["strange_msgs/Part"](1)
    pair = make_node("talker").advertise("/pair", strange["strange_msgs/Pair"], latch=True)
    pair.publish(strange["strange_msgs/Pair"](left=left))

    assert commands.run("rostopic", "echo", "-n", "1", "/pair").stdout == [
        "left: ", "  number: 1", "right: ", "  number: 0", "---",
    ]  # fmt: skip
    assert commands.run("rostopic", "echo", "-n", "1", "/pair/left/number").stdout == ["1", "---"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_echo_with_0_and_without_registrations(commands, talker, client, number) -> None:
    echo = commands.start("rostopic", "echo", "/chatter")
    wait_until_connected(talker)
    echo.send_signal(number, code=0)
    assert echo.lines == []
    wait_until(lambda: SystemState.from_state(client.get_system_state()).nodes() == ["/talker"])
    assert client.call("pipros.getStatistics")["calls_by_method"]["unregisterSubscriber"] == 1


def test_echo_ends_quietly_when_its_reader_closes_the_pipe(commands: Commands, talker: Publisher) -> None:
    bash = shutil.which("bash")
    assert bash
    pipe = commands.start(bash, "-c", "set -o pipefail; rostopic echo /chatter | head -n 1")
    wait_until_connected(talker)

    def publish_and_look() -> bool:
        talker.publish(String("hello"))
        return not pipe.is_running

    wait_until(publish_and_look, what="echo ends")
    assert (pipe.wait(), pipe.lines) == (0, ['data: "hello"'])


def test_echo_waits_for_a_topic_and_reports_that_once(commands: Commands, make_node: MakeNode) -> None:
    echo = commands.start("rostopic", "echo", "-n", "1", "/late/data")
    echo.wait_for(r"WARNING: topic \[/late/data\] does not appear to be published yet")
    make_node("talker").advertise("/late", String, latch=True).publish(String("at last"))

    assert (echo.wait(), echo.stdout, len(echo.stderr)) == (0, ['"at last"', "---"], 1)


def test_waiting_for_a_topic_ends_with_ctrl_c(commands: Commands) -> None:
    hz = commands.start("rostopic", "hz", "/never")
    hz.wait_for("WARNING")
    hz.press_ctrl_c()

    assert hz.wait() == 1, "as Noetic's, which has nothing to measure"
    assert len(hz.lines) == 1


def test_echo_follows_a_topic_across_restarts_of_publishers(commands: Commands, make_node: MakeNode) -> None:
    first = make_node("first")
    first.advertise("/chatter", String, latch=True).publish(String("one"))
    echo = commands.start("rostopic", "echo", "-n", "2", "/chatter")
    echo.wait_for("one")
    first.shutdown("restart")
    make_node("second").advertise("/chatter", String, latch=True).publish(String("two"))

    assert (echo.wait(), echo.stdout) == (0, ['data: "one"', "---", 'data: "two"', "---"])


def test_an_index_beyond_an_array_is_reported_and_the_next_message_is_shown(commands, make_node) -> None:
    numbers = load_message_class("std_msgs/Int32MultiArray")
    publisher = make_node("talker").advertise("/numbers", numbers)
    echo = commands.start("rostopic", "echo", "-n", "1", "/numbers/data[1]")
    wait_until_connected(publisher)
    publisher.publish(numbers(data=[1]))
    publisher.publish(numbers(data=[1, 2]))

    assert (echo.wait(), echo.stdout) == (0, ["2", "---"])
    assert echo.stderr == ["tuple index out of range: /data[1]"]


def test_a_filter_that_fails_is_reported_once_and_hides_messages(commands, make_node: MakeNode) -> None:
    numbers = load_message_class("std_msgs/Int32MultiArray")
    publisher = make_node("talker").advertise("/numbers", numbers)
    echo = commands.start("rostopic", "echo", "-n", "1", "--filter", "m.data[0] > 1", "/numbers/data")
    wait_until_connected(publisher)
    for data in ([], [], [1], [2]):
        publisher.publish(numbers(data=data))

    assert (echo.wait(), echo.stdout, len(echo.stderr)) == (0, ["[2]", "---"], 1)
    assert "index out of range" in echo.stderr[0]


def test_a_filter_cannot_run_python(commands: Commands, talker: Publisher, tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    expression = f"__import__('pathlib').Path('{trace}').touch() or True"
    echo = commands.start("rostopic", "echo", "--filter", expression, "/chatter")
    wait_until_connected(talker)
    talker.publish(String("hello"))
    echo.wait_for("ERROR: in the expression")
    echo.press_ctrl_c(code=0)
    assert not trace.exists()


@pytest.mark.parametrize(
    ("subcommand", "report"),
    [
        (
            "hz -w -3",
            (r"^average rate: [\d.]+$", r"^\tmin: [\d.]+s max: [\d.]+s std dev: [\d.]+s window: \d+$"),
        ),
        ("bw -w 0", (r"^average: [\d.]+B/s$", r"^\tmean: 9.00B min: 9.00B max: 9.00B window: \d+$")),
    ],
)
def test_measures_are_reported_until_ctrl_c(commands, talker, subcommand, report: tuple[str, str]) -> None:
    measuring = commands.start("rostopic", *subcommand.split(), "/chatter")
    measuring.wait_for(r"subscribed to \[/chatter\]")
    wait_until_connected(talker)
    for _ in range(5):
        talker.publish(String("hello"))
    for line in report:
        measuring.wait_for(line)
    measuring.press_ctrl_c(code=0)
    assert measuring.stderr == []


def test_hz_compares_topics_in_a_table(commands: Commands, make_node: MakeNode) -> None:
    node = make_node("talker")
    publishers = [node.advertise(topic, String) for topic in ("/a", "/b")]
    hz = commands.start("rostopic", "hz", "/a", "/b")
    for publisher in publishers:
        wait_until_connected(publisher)
        for _ in range(3):
            publisher.publish(String("hello"))
    for line in (r"topic +rate +min_delta +max_delta +std_dev +window$", "^=+$", "^/a ", "^/b "):
        hz.wait_for(line)
    hz.press_ctrl_c(code=0)


def test_hz_of_a_silent_topic_reports_no_new_messages(commands: Commands, talker: Publisher) -> None:
    hz = commands.start("rostopic", "hz", talker.topic)
    hz.wait_for("no new messages")
    hz.press_ctrl_c(code=0)


@pytest.mark.parametrize(("option", "report"), [((), "no new messages"), (("--wall-time",), "average rate")])
def test_hz_measures_by_the_simulated_clock_by_default(commands, client, talker, option, report: str) -> None:
    client.set_param("/use_sim_time", True)  # without a publisher of /clock, simulated time stands still
    hz = commands.start("rostopic", "hz", *option, "/chatter")
    wait_until_connected(talker)
    for _ in range(3):
        talker.publish(String("hello"))
    hz.wait_for(report)
    hz.press_ctrl_c(code=0)


@pytest.mark.parametrize(
    ("words", "report"), [(("echo",), r"nsecs: +7"), (("echo", "-p"), r"7$"), (("bw",), "average")],
    ids=" ".join,
)  # fmt: skip
def test_the_clock_that_the_command_follows_can_be_listened_to(
    commands: Commands, client: MasterClient, make_node: MakeNode, words: tuple[str, ...], report: str
) -> None:
    client.set_param("/use_sim_time", True)
    clock = make_node("world").advertise("/clock", Clock)
    listening = commands.start("rostopic", *words, "/clock")
    seconds = itertools.count(1)

    def is_reported() -> bool:
        clock.publish(Clock(Time(next(seconds), 7)))
        return any(re.search(report, line) for line in listening.lines)

    wait_until(is_reported, 60, lambda: listening.output)
    listening.press_ctrl_c()

    listening.check(0)


def test_delay_is_the_age_of_the_stamps(commands: Commands, make_node: MakeNode) -> None:
    node = make_node("talker")
    point = load_message_class("geometry_msgs/PointStamped")
    publisher = node.advertise("/point", point)
    delay = commands.start("rostopic", "delay", "/point")
    delay.wait_for(r"subscribed to \[/point\]")
    wait_until_connected(publisher)
    message = point()
    message.header.stamp.secs = node.clock.now_ns() // 1_000_000_000 - 100
    for _ in range(3):
        publisher.publish(message)
    delay.wait_for(r"^average delay: 1\d\d\.\d+$")  # and a message may take seconds on a busy machine
    delay.wait_for(r"^\tmin: 1\d\d\.\d+s max: 1\d\d\.\d+s std dev: [\d.]+s window: 3$")
    delay.press_ctrl_c(code=0)


def test_delay_of_messages_without_a_header_is_a_plain_error(commands: Commands, talker: Publisher) -> None:
    delay = commands.start("rostopic", "delay", "/chatter")
    delay.wait_for(r"subscribed to")
    wait_until_connected(talker)
    talker.publish(String("hello"))
    delay.wait_for("msg does not have header")
    delay.press_ctrl_c(code=0)


# rostopic pub to running subscribers.


@pytest.fixture
def inbox(make_node: MakeNode) -> Inbox:
    """The messages that a node receives on /words."""
    return Inbox.of(make_node("listener"), "/words", String)


def test_a_rate_repeats_the_message_until_ctrl_c(commands: Commands, inbox: Inbox) -> None:
    pub = commands.start("rostopic", "pub", "-r", "50", "/words", "std_msgs/String", "hello")
    assert {message.data for message in inbox.wait(3)} == {"hello"}
    pub.press_ctrl_c(code=0)
    assert pub.lines == []


def test_text_need_not_be_ascii(commands: Commands, inbox: Inbox) -> None:
    pub = commands.start("rostopic", "pub", "-r", "50", "/words", "std_msgs/String", "data: grün 低")
    assert inbox.wait()[0].data == "grün 低"
    pub.press_ctrl_c(code=0)


def test_a_latched_message_reaches_later_subscribers(commands: Commands, make_node: MakeNode) -> None:
    pub = commands.start("rostopic", "pub", "/words", "std_msgs/String", "data: hello")
    pub.wait_for(r"publishing and latching message. Press ctrl-C to terminate")
    inbox = Inbox.of(make_node("late"), "/words", String)
    assert inbox.wait()[0].data == "hello"
    pub.press_ctrl_c(code=0)


@pytest.fixture
def waiting(ros: RosSystem, master: Master, make_node: MakeNode) -> Process:
    """Start a publisher that waits for messages from a pipe."""
    client = make_node("looker").master
    pub = ros.pipros.processes.start(
        *("rostopic", "pub", "/words", "std_msgs/String"), stdin=subprocess.PIPE,
        environment={"ROS_MASTER_URI": master.uri},
    )  # fmt: skip
    wait_until(lambda: "/words" in dict(client.get_system_state()[0]), what="a publisher")
    return pub


def test_ctrl_c_ends_it_while_it_waits_for_a_pipe(waiting: Process) -> None:
    waiting.press_ctrl_c(code=0)
    assert waiting.lines == []


def test_rosnode_kill_ends_it_while_it_waits_for_a_pipe(commands: Commands, waiting: Process) -> None:
    killed = commands.run("rosnode", "kill", "-a")
    assert "killed" in killed.stdout

    assert (waiting.wait(), waiting.lines) == (0, [])


def test_every_document_of_a_pipe_is_a_message(commands: Commands, inbox: Inbox) -> None:
    bash = shutil.which("bash")
    assert bash
    pipe = commands.run(
        bash, "-c", "printf 'data: one\\n---\\ndata: two\\n' | rostopic pub /words std_msgs/String"
    )
    assert [message.data for message in inbox.wait(2)] == ["one", "two"]
    assert (pipe.returncode, pipe.stderr) == (0, [])


def test_every_document_of_a_file_is_a_message(commands: Commands, inbox: Inbox, tmp_path: Path) -> None:
    file = tmp_path / "words.yaml"
    file.write_text("data: one\n---\ndata: two\n---\n")
    pub = commands.run("rostopic", "pub", "-r", "50", "-f", file, "/words", "std_msgs/String")
    assert [message.data for message in inbox.wait(2)] == ["one", "two"]
    assert pub.returncode == 0


def test_now_is_the_time_of_each_message_with_substitution(commands: Commands, make_node: MakeNode) -> None:
    inbox = Inbox.of(make_node("listener"), "/stamps", load_message_class("std_msgs/Time"))
    pub = commands.start("rostopic", "pub", "-s", "-r", "50", "/stamps", "std_msgs/Time", "now")
    first, second = inbox.wait(2)[:2]
    pub.press_ctrl_c(code=0)
    assert first.data < second.data


def test_a_value_of_the_wrong_type_is_refused_before_anything_is_sent(commands: Commands) -> None:
    pub = commands.run("rostopic", "pub", "-1", "/number", "std_msgs/Int32", "hello")
    assert pub.returncode == 1
    assert pub.stderr == ["ERROR: field data must be an integer type", "", "Args are: [data]"]


def test_a_subscriber_that_did_not_connect_is_named(commands: Commands, master: Master) -> None:
    slave = FakeSlave()  # it is notified, but does not connect
    lost = MasterClient(master.uri, "/base")
    lost.register_subscriber("/words", "std_msgs/String", slave.api)

    pub = commands.run("rostopic", "pub", "-1", "/words", "std_msgs/String", "hello")

    assert pub.returncode == 0
    (line,) = pub.stderr
    assert line.startswith("/base subscribes, but has not connected to this publisher.")
    assert "ROS_IP" in line
    lost.close()
    slave.stop()


def test_nothing_is_said_of_a_topic_without_subscribers(commands: Commands) -> None:
    pub = commands.run("rostopic", "pub", "-1", "/nobody", "std_msgs/String", "hello")
    assert (pub.returncode, pub.stderr) == (0, [])
