"""`rosbag record` and `rosbag play` with running nodes."""

import io
import itertools
import os
import re
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Empty, Int32, String, UInt8MultiArray
from std_srvs.srv import Trigger

import rospy
from pipros.node import Node
from pipros_tools.bag import BagReader, BagWriter
from pipros_tools.bag.options import PlayOptions
from pipros_tools.bag.player import Player
from tests.support.bags import bag_bytes, header_of, rows_of
from tests.support.nodes import Inbox, MakeNode, wait_until_connected
from tests.support.ros import Commands, RosSystem
from tests.support.waiting import wait_until


@pytest.fixture
def talker(make_node: MakeNode) -> Node:
    return make_node("talker")


def listen(make_node: MakeNode, topic: str, kind: Any = Int32, **options: Any) -> Inbox:
    return Inbox.of(make_node("listener"), topic, kind, **options)


def data_of(messages: list[Any]) -> list[Any]:
    return [message.data for message in messages]


def publish(node: Node, topic: str, messages: list[Any], **options: Any) -> None:
    """Publish to the only subscriber."""
    publisher = node.advertise(topic, type(messages[0]), queue_size=None, **options)
    wait_until(lambda: publisher.connection_count, what=f"a subscriber of {topic}")
    for message in messages:
        publisher.publish(message)


def recorded(path: Path) -> list[tuple[str, Any]]:
    with BagReader(path) as bag:
        return [row[:2] for row in rows_of(bag)]


def message_count(active: Path) -> int:
    """Return the messages in a file that is being written; 0 if it does not exist yet."""
    if not active.exists():
        return 0
    with BagReader(active, rebuild_index=True) as bag:
        return bag.message_count


def bag_of(path: Path, count: int = 20) -> Path:
    rows: list[Any] = [("/number", Int32(n), 100 + n // 10, n % 10 * 1000) for n in range(count)]
    path.write_bytes(bag_bytes([("/text", String("latched"), 99, 0), *rows], chunk_bytes=300))
    return path


def test_published_messages_are_recorded_until_ctrl_c(commands: Commands, talker: Node) -> None:
    record = commands.start("rosbag", "record", "--chunksize", "0", "-O", "run", "/number", "/text")
    active = commands.home / "run.bag.active"
    publish(talker, "/number", [Int32(n) for n in range(50)])
    wait_until(lambda: message_count(active) == 50, what="the numbers in the file")
    publish(talker, "/text", [String("a"), String("b")], latch=True)
    wait_until(lambda: message_count(active) == 52, what="all messages in the file")
    record.press_ctrl_c(code=0)
    assert not active.exists()
    found = recorded(commands.home / "run.bag")
    assert found == [*(("/number", n) for n in range(50)), ("/text", "a"), ("/text", "b")]
    with BagReader(commands.home / "run.bag") as bag:
        by_topic = {connection.topic: connection for connection in bag.connections}
    assert by_topic["/text"].is_latching
    assert by_topic["/number"].callerid == "/talker"
    assert by_topic["/number"].definition == Int32._full_text


def test_the_clock_that_the_recorder_follows_is_recorded(commands: Commands, talker: Node) -> None:
    talker.master.set_param("/use_sim_time", True)
    clock = talker.advertise("/clock", Clock, queue_size=None)
    record = commands.start(
        "rosbag", "record", "--chunksize", "0", "--duration", "100", "-O", "run", "/clock"
    )
    wait_until(lambda: clock.connection_count, what="a subscriber of /clock")
    active = commands.home / "run.bag.active"
    ticks = itertools.count(1000)

    def is_written() -> bool:
        clock.publish(Clock(rospy.Time(next(ticks), 7)))
        return active.exists() and message_count(active) > 2

    wait_until(is_written, what="messages of /clock in the file")
    record.press_ctrl_c(code=0)
    with BagReader(commands.home / "run.bag") as bag:
        assert bag.connections[0].type == "rosgraph_msgs/Clock"
        assert all(message.clock.nsecs == 7 for _, message, *_ in bag.messages())


def test_queued_messages_are_compressed_and_written_after_ctrl_c(commands: Commands, talker: Node) -> None:
    record = commands.start("rosbag", "record", "-j", "-O", "slow", "/noise")
    noise = os.urandom(1_000_000)
    publish(talker, "/noise", [UInt8MultiArray(data=noise)] * 20)
    active = commands.home / "slow.bag.active"
    wait_until(lambda: active.stat().st_size > len(noise), what="a chunk in the file")
    record.press_ctrl_c(code=0)
    assert not active.exists()
    assert recorded(commands.home / "slow.bag")


def test_a_limit_ends_the_recording(commands: Commands, talker: Node) -> None:
    record = commands.start("rosbag", "record", "-q", "-l", "3", "-O", "few.bag", "-j", "/number")
    publish(talker, "/number", [Int32(n) for n in range(10)])

    assert record.wait() == 0
    assert recorded(commands.home / "few.bag") == [("/number", 0), ("/number", 1), ("/number", 2)]
    assert record.stdout == []


def test_snapshots_are_written_on_request(commands: Commands, talker: Node) -> None:
    words = ("--snapshot", "--repeat-latched", "-O", "snap", "/number", "/text", "__name:=recorder")
    record = commands.start("rosbag", "record", *words)
    number = talker.advertise("/number", Int32, queue_size=None)
    texts = talker.advertise("/text", String, latch=True)
    texts.publish(String("latched"))
    trigger = talker.advertise("/snapshot_trigger", Empty, queue_size=None)
    record.wait_for("Waiting for a message on snapshot_trigger")
    for publisher in (number, texts, trigger):
        wait_until_connected(publisher)
    take = talker.client("/recorder/trigger_snapshot", Trigger)
    found: list[list[tuple[str, Any]]] = []

    def ask_until(row: tuple[str, Any]) -> None:
        """Take snapshots until one contains this message."""
        while not any(row in rows for rows in found):
            answer = take.call(Trigger._request_class(), timeout_s=30)
            if answer.success:
                found.append(recorded(commands.home / answer.message))

    ask_until(("/text", "latched"))
    for value in (1, 2):
        number.publish(Int32(value))
        ask_until(("/number", value))
    trigger.publish(Empty())
    record.wait_for(rf"Wrote a snapshot of 1 messages to 'snap_{len(found)}.bag'")
    record.press_ctrl_c(code=0)
    assert not list(commands.home.glob("*.active"))
    assert [value for rows in found for topic, value in rows if topic == "/number"] == [1, 2]
    assert ("/text", "latched") in found[-1]


def test_a_snapshot_starts_at_the_first_simulated_time(commands: Commands, talker: Node) -> None:
    talker.master.set_param("/use_sim_time", True)
    texts = talker.advertise("/text", String, latch=True)
    texts.publish(String("early"))
    record = commands.start("rosbag", "record", "--snapshot", "-O", "snap", "/text", "__name:=recorder")
    early = commands.start("rosbag", "record", "-O", "early", "/text")
    for each in (record, early):
        each.wait_for("waiting for simulated time")
    early.press_ctrl_c()
    early.wait_for("no bag was written")
    early.check(0)
    clock = talker.advertise("/clock", Clock, latch=True)
    clock.publish(Clock(rospy.Time(1000)))
    record.wait_for("Waiting for a message on snapshot_trigger")
    take = talker.client("/recorder/trigger_snapshot", Trigger)
    wait_until(lambda: take.call(Trigger._request_class(), timeout_s=30).success, what="a snapshot")
    record.press_ctrl_c(code=0)
    with BagReader(commands.home / "snap.bag") as bag:
        assert [time.secs for _, _, time, *_ in bag.messages()] == [1000]


def test_expressions_choose_topics_that_appear_later(commands: Commands, talker: Node) -> None:
    record = commands.start("rosbag", "record", "-e", "/n.*", "-x", ".*secret", "-O", "chosen")
    record.wait_for("Recording to 'chosen.bag'")
    talker.advertise("/text", String)
    talker.advertise("/number_secret", Int32)
    publish(talker, "/number", [Int32(5)])
    record.press_ctrl_c()

    record.check(0, "Subscribing to /number")
    assert not any(name in record.output for name in ("/text", "secret"))


def test_a_killed_recording_loses_only_the_current_chunk(commands: Commands, talker: Node) -> None:
    record = commands.start("rosbag", "record", "--chunksize", "1", "-O", "killed", "/text")
    active = commands.home / "killed.bag.active"
    publish(talker, "/text", [String("x" * 200 + str(n)) for n in range(200)])
    wait_until(lambda: active.stat().st_size > 40_000, what="some chunks")
    record.send_signal(signal.SIGKILL)
    record.wait()

    with BagReader(active, rebuild_index=True) as bag:
        texts = [message.data[200:] for _, message, _, _ in bag]
    assert texts == [str(n) for n in range(len(texts))]
    assert len(texts) > 100
    reindexed = commands.run("rosbag", "reindex", "killed.bag.active")
    assert reindexed.returncode == 0, reindexed.output
    assert len(recorded(active)) == len(texts)


def test_a_full_disk_leaves_a_valid_bag_and_disturbs_no_publisher(commands: Commands, talker: Node) -> None:
    """Limit the files of this shell to 2 MB, which has the same effect as a full disk."""
    limited = "ulimit -f 2000 && exec rosbag record -L 1 --chunksize 100 -O full /text"
    record = commands.start("bash", "-c", limited)
    text = "x" * 10_000
    publish(talker, "/text", [String(text + str(n)) for n in range(250)])
    record.wait_for("cannot write to 'full.bag': File too large. Recording resumes when writing succeeds")
    publish(talker, "/text", [String("not recorded")])
    record.press_ctrl_c(code=1)
    assert re.search(r"the disk with 'full.bag' is full: the last \d+ messages were discarded", record.output)
    assert re.search(r"\d+ messages were dropped, \d+ in all: the disk is full", record.output)
    assert not (commands.home / "full.bag.active").exists()
    # The recorder looks at the disk every five seconds, so the last, short message may have its chance.
    messages = [message for _, message in recorded(commands.home / "full.bag")]
    found = [message[len(text) :] for message in messages if message.startswith(text)]
    assert found == [str(n) for n in range(len(found))]
    assert len(found) > 150


def test_a_recording_without_its_minimum_space_names_the_option(commands: Commands, talker: Node) -> None:
    record = commands.start("rosbag", "record", "--min-space=1000000G", "-O", "none", "/text")
    publish(talker, "/text", [String("not recorded")])
    record.wait_for(r"1 in all: less than \d+ bytes are free \(see --min-space\)")
    record.press_ctrl_c()

    record.wait()
    assert "full" not in record.output


def test_a_recording_is_split_and_keeps_the_newest_files(commands: Commands, talker: Node) -> None:
    words = (
        "record", "--split", "--size", "1", "--chunksize", "64", "--max-splits", "2", "-O", "part", "/text",
    )  # fmt: skip
    record = commands.start("rosbag", *words, "--repeat-latched")
    publish(talker, "/text", [String("x" * 100_000) for _ in range(45)], latch=True)
    record.wait_for("Recording to 'part_4.bag'")
    record.press_ctrl_c(code=0)
    names = sorted(path.name for path in commands.home.glob("part*"))
    assert (len(names), names[0]) == (2, "part_3.bag")
    assert all(recorded(commands.home / name) for name in names)


def test_a_bag_is_played_in_order_with_types_and_latching(commands: Commands, make_node: MakeNode) -> None:
    bag_of(commands.home / "in.bag")
    inbox, texts = Inbox(), Inbox()
    listener = make_node("listener")
    listener.subscribe("/p/number", Int32, inbox)
    listener.subscribe("/p/text", String, texts)
    play = commands.start("rosbag", "play", "-r", "50", "-p", "/p", "--wait-for-subscribers", "in.bag")

    assert data_of(inbox.wait(20)) == list(range(20))
    assert texts.wait()[0].data == "latched"
    assert (play.wait(), play.stdout[-1]) == (0, "Done.")


@pytest.mark.timeout(300)
def test_a_thousand_topics_are_played_and_recorded(commands: Commands) -> None:
    rows = [(f"/t{n % 1000}", Int32(n), 100 + n // 1000, n % 1000) for n in range(3000)]
    (commands.home / "in.bag").write_bytes(bag_bytes(rows))
    record = commands.start("rosbag", "record", "--chunksize", "0", "-a", "-x", "/rosout.*", "-O", "run")
    active = commands.home / "run.bag.active"

    play = commands.start("rosbag", "play", "-r", "2", "--wait-for-subscribers", "in.bag")

    assert play.wait(120) == 0, play.output
    wait_until(
        lambda: message_count(active) == 3000, 60, lambda: f"{message_count(active)} messages recorded"
    )
    record.press_ctrl_c(code=0)
    assert sorted(recorded(commands.home / "run.bag")) == sorted((topic, m.data) for topic, m, *_ in rows)


def test_parts_and_the_clock_are_played(commands: Commands, make_node: MakeNode) -> None:
    bag_of(commands.home / "in.bag")
    inbox, clock = Inbox(), Inbox()
    listener = make_node("listener")
    listener.subscribe("/number", Int32, inbox)
    listener.subscribe("/clock", Clock, clock)
    words = ("--clock", "-s", "1.5", "-u", "0.8", "--topics", "/number", "--bags", "in.bag")
    # Slowly, so that a listener that is late gets a part of the clock.
    play = commands.start("rosbag", "play", "-d", "2", "-r", "0.2", "--wait-for-subscribers", *words)

    assert data_of(inbox.wait(10)) == list(range(10, 20))
    assert play.wait() == 0
    times = [message.clock.to_sec() for message in clock.wait(5)]
    assert times == sorted(times)
    assert 100.4 < times[0] < 101.4


def test_a_loop_continues_until_ctrl_c(commands: Commands, make_node: MakeNode) -> None:
    bag_of(commands.home / "in.bag")
    inbox = listen(make_node, "/number")
    play = commands.start(
        "rosbag", "play", "-l", "-i", "--wait-for-subscribers", "--topics", "/number", "--bags=in.bag"
    )
    numbers = data_of(inbox.wait(50))
    play.press_ctrl_c(code=0)
    assert numbers[:20] == numbers[20:40] == list(range(20))


@pytest.mark.parametrize(
    ("words", "code", "complaint"),
    [
        (("play", "none.bag"), 1, "Error opening file: none.bag: No such file or directory"),
        (("play", "in.bag", "--topics", "/none"), 1, "No messages to play on specified topics"),
        (("play",), 2, "You must specify at least 1 bag file to play back."),
        (("play", "-r", "0", "in.bag"), 2, "rate must be greater than zero, got 0.0"),
        (("record",), 2, "You must specify a topic name or else use the '-a' option."),
        (("record", "-a", "--split"), 2, "Split specified without giving a maximum duration or size"),
        (("record", "-o", "a", "-O", "b", "/x"), 2, "Can't set both prefix and name."),
        (("record", "-a", "--duration", "x"), 2, "Duration specification invalid: x"),
        (("record", "-a", "-l", "2"), 1, "--limit needs the names of topics"),
        (("record", "--size=-1", "/x"), 2, "--size must not be less than zero, got -1"),
        (("record", "a b"), 1, "invalid topic name: [a b]"),
        (("record", "-e", "("), 1, "[(] is not a regular expression"),
    ],
)
def test_invalid_arguments_are_explained(words, code: int, complaint: str, commands: Commands) -> None:
    bag_of(commands.home / "in.bag")
    done = commands.start("rosbag", *words)

    done.check(code, complaint)


def test_launch_files_and_rosrun_know_record_and_play(commands: Commands, make_node: MakeNode) -> None:
    bag_of(commands.home / "in.bag")
    (commands.home / "both.launch").write_text(
        f"""<launch>
        <node pkg="rosbag" type="play" name="player"
          args="-d 0 --wait-for-subscribers {commands.home}/in.bag"/>
        <node pkg="rosbag" type="record" name="recorder"
          args="-q -l 20 --size=0 -O {commands.home}/out.bag /number"/>
        </launch>"""
    )
    inbox = listen(make_node, "/text", String)
    launch = commands.start("roslaunch", "both.launch")

    assert inbox.wait()[0].data == "latched"
    wait_until((commands.home / "out.bag").exists, what="the recording")
    assert launch.wait() == 0
    assert len(recorded(commands.home / "out.bag")) == 20
    played = commands.run("rosrun", "rosbag", "play", "-i", "-q", str(commands.home / "in.bag"))
    assert (played.returncode, played.output) == (0, "")


@contextmanager
def playing(player: Player) -> Iterator[None]:
    """Play in a thread, to the end of the bag."""
    thread = threading.Thread(target=player.run)
    thread.start()
    yield
    thread.join(30)
    assert not thread.is_alive()


class _Keys:
    """A keyboard whose keys the test presses, and a display that counts lines."""

    def __init__(self) -> None:
        self.pressed: list[str] = []
        self.states: set[str] = set()

    def key(self) -> str:
        return self.pressed.pop(0) if self.pressed else ""

    def show(self, state: str, bag_s: float, played_s: float, whole_s: float) -> None:
        self.states.add(state)


def test_a_pause_is_stepped_through_and_ended_by_keys(make_node: MakeNode, tmp_path: Path) -> None:
    inbox, keys = listen(make_node, "/number"), _Keys()
    options = PlayOptions(paused=True, rate=1000.0, wait_for_subscribers=True, topics=["number"])
    with BagReader(bag_of(tmp_path / "in.bag")) as bag:
        player = Player(make_node("player"), [bag], options, keys, lambda _: None)
        with playing(player):
            wait_until(lambda: "PAUSED" in keys.states, what="the pause")
            assert inbox.messages == []
            keys.pressed += ["s", "s"]
            assert data_of(inbox.wait(2)) == [0, 1]
            wait_until(lambda: not keys.pressed, what="the keys to be taken")
            assert len(inbox.messages) == 2
            keys.pressed.append(" ")
            assert data_of(inbox.wait(20)) == list(range(20))
    assert keys.states == {"PAUSED", "RUNNING"}


def test_images_that_wait_for_a_slow_subscriber_arrive_unchanged(make_node: MakeNode, tmp_path: Path) -> None:
    inbox, may_go_on = Inbox(), threading.Event()
    pictures = [UInt8MultiArray(data=bytes([n]) * 200_000) for n in range(12)]
    rows: list[Any] = [("/image", each, 100, n) for n, each in enumerate(pictures)]
    rows += [("/number", Int32(n), 100, n) for n in range(60)]
    path = tmp_path / "in.bag"
    path.write_bytes(bag_bytes(sorted(rows, key=lambda row: row[3]), chunk_bytes=500_000))

    def slow(message: Any) -> None:
        may_go_on.wait(30)
        inbox(message)

    make_node("listener").subscribe("/image", UInt8MultiArray, slow)
    options = PlayOptions(immediate=True, wait_for_subscribers=True, topics=["/image"])
    with BagReader(path) as bag:
        Player(make_node("player"), [bag], options, _Keys(), lambda _: None).run()
        may_go_on.set()
        assert [bytes(message.data) for message in inbox.wait(12)] == [each.data for each in pictures]


@pytest.mark.parametrize("options", [{"immediate": True}, {"rate": 20.0, "clock": True}])
def test_messages_that_are_due_without_subscribers_are_not_read(make_node, tmp_path, options) -> None:
    inbox = Inbox()
    rows: list[Any] = [("/heard", Int32(n), 100, n) for n in range(20)]
    rows += [("/unheard", Int32(n), 100, n) for n in range(20, 40)]
    rows += [("/heard", Int32(n), 100, n) for n in range(40, 60)]
    data = bytearray(bag_bytes(rows, chunk_bytes=300))
    with BagReader(io.BytesIO(data)) as bag:
        [unheard] = bag.connections_of("/unheard")
        headers = [
            bag.chunk_header(n) for n, each in enumerate(bag.chunks) if set(each.counts) == {unheard.id}
        ]
    assert headers
    for header in headers:
        data[header.data_position : header.data_position + header.size] = bytes(header.size)
    subscriber = make_node("listener").subscribe("/heard", Int32, inbox)
    keys = _Keys()
    with BagReader(io.BytesIO(data)) as bag:
        chosen = PlayOptions(paused=True, **options)
        player = Player(make_node("player"), [bag], chosen, keys, lambda _: None)
        with playing(player):
            wait_until(lambda: subscriber.connection_count, what="the player's topic")
            keys.pressed.append(" ")
            assert data_of(inbox.wait(40)) == [*range(20), *range(40, 60)]


def test_a_topic_pauses_the_playback(make_node: MakeNode, tmp_path: Path) -> None:
    inbox, keys = listen(make_node, "/number"), _Keys()
    options = PlayOptions(
        immediate=True, wait_for_subscribers=True, topics=["/number"], pause_topics=["/number"]
    )
    with BagReader(bag_of(tmp_path / "in.bag", 3)) as bag:
        player = Player(make_node("player"), [bag], options, keys, lambda _: None)
        with playing(player):
            for count in range(1, 4):
                assert len(inbox.wait(count)) == count
                wait_until(lambda: "PAUSED" in keys.states, what="the pause")
                keys.states.clear()
                keys.pressed.append(" ")


def test_latched_topics_exist_long_enough_for_a_search(make_node: MakeNode, tmp_path: Path) -> None:
    """Genuine `record -a` searches every second, and might miss a bag that plays for less."""
    with (tmp_path / "in.bag").open("w+b") as file:
        writer = BagWriter(file)
        for topic, latching in (("/number", "0"), ("/fixed", "1")):
            connection = writer.add_connection(topic, header_of(Int32(), topic, latching=latching))
            writer.write_message(connection, 100, 0, Int32(1))
        writer.finish()
        for topic, is_long in (("/number", False), ("/fixed", True)):
            options = PlayOptions(delay_s=0.0, immediate=True, topics=[topic])
            player = make_node("player")
            waits: list[float | None] = []
            player.wait_for_shutdown = waits.append  # type: ignore[method-assign, assignment]
            Player(player, [BagReader(file)], options, _Keys(), lambda _: None).run()
            assert any(wait is not None and wait > 0.1 for wait in waits) is is_long


def test_a_bag_of_ros2_is_played_as_ros1(commands: Commands, make_node: MakeNode) -> None:
    bag_of(commands.home / "in.bag")
    done = commands.run("rosbag", "convert", "--ros2", "humble", "in.bag", "ros2")
    assert done.returncode == 0, done.output
    inbox = listen(make_node, "/number", queue_size=None)

    player = commands.start(
        "rosbag", "play", "-i", "--wait-for-subscribers", "--topics", "/number", "--bags=ros2"
    )

    assert data_of(inbox.wait(20)) == list(range(20))
    assert player.wait() == 0


def test_only_topics_that_would_be_played_need_legal_names(commands: Commands, make_node: MakeNode) -> None:
    rows: list[Any] = [
        ("/number", Int32(1), 10, 0), ("/number", Int32(2), 11, 0), ("/no topic!", Int32(3), 20, 0),
    ]  # fmt: skip
    (commands.home / "run.bag").write_bytes(bag_bytes(rows))
    inbox = listen(make_node, "/number")

    part = commands.start("rosbag", "play", "-i", "-d", "1", "-u", "5", "run.bag")

    assert part.wait() == 0
    wait_until(lambda: data_of(inbox.messages) == [1, 2])
    whole = commands.start("rosbag", "play", "-i", "run.bag")
    whole.check(1, "[/no topic!] is not a legal topic name")


def test_a_topic_is_played_without_doubled_slashes(commands: Commands, make_node: MakeNode) -> None:
    """Nodes that join namespaces by hand leave such names in bags."""
    (commands.home / "run.bag").write_bytes(bag_bytes([("//robot//number/", Int32(1), 10, 0)]))
    inbox = listen(make_node, "/robot/number")

    player = commands.start("rosbag", "play", "-i", "--wait-for-subscribers", "run.bag")

    assert data_of(inbox.wait(1)) == [1]
    assert player.wait() == 0


def test_nodes_that_connect_later_get_the_last_message_of_each_recorded_publisher(
    make_node: MakeNode, tmp_path: Path
) -> None:
    rows = [("1", "/a", 1), ("0", "/c", 2), ("1", "/b", 3), ("1", "/a", 4), ("0", "/c", 5)]
    with (tmp_path / "in.bag").open("w+b") as file:
        writer = BagWriter(file)
        connections: dict[str, Any] = {}
        for latching, caller, number in rows:
            if caller not in connections:
                header = header_of(Int32(), "/number", latching=latching, callerid=caller)
                connections[caller] = writer.add_connection("/number", header)
            writer.write_message(connections[caller], 100, number, Int32(number))
        writer.finish()
        options = PlayOptions(delay_s=0.0, immediate=True)
        Player(make_node("player"), [BagReader(file)], options, _Keys(), lambda _: None).run()

        inbox = Inbox.of(make_node("late"), "/number", Int32)

        assert data_of(inbox.wait(2)) == [3, 4]


@pytest.mark.parametrize("name", ["run.bag", "run.mcap"])
def test_a_killed_recording_lost_at_most_a_second(commands: Commands, talker: Node, name: str) -> None:
    """After one message has just reached the file, the next one does so within seconds, not within ten."""
    recorder = commands.start("rosbag", "record", "-O", name, "/text")
    publisher = talker.advertise("/text", String, queue_size=None)
    wait_until(lambda: publisher.connection_count, what="the recorder")
    active = commands.home / f"{name}.active"
    for text in ("the first message", "the second message"):
        publisher.publish(String(text))
        assert wait_until(lambda text=text: text.encode() in active.read_bytes(), timeout_s=6)
    recorder.kill()
    recorder.wait()

    ran = commands.run("rosbag", "reindex", active)

    assert ran.returncode == 0, ran.output
    assert commands.run("rosbag", "info", "-y", "-k", "messages", active).output.strip() == "2"


def test_play_waits_for_the_master(ros: RosSystem) -> None:
    (ros.home / "in.bag").write_bytes(bag_bytes([("/t", Int32(1), 100, 0)]))
    play = ros.pipros.start("rosbag", "play", "in.bag")
    play.wait_for("Will keep trying")
    assert "after advertising" not in play.output
    ros.serve_master()
    assert (play.wait(), play.stdout[-1]) == (0, "Done.")
