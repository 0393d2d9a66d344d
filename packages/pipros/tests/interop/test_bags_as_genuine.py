"""Bags of either side are read by both, with the same results; `rosbag` has the options of genuine rosbag."""

import io
import json
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import pytest
from std_msgs.msg import Int32, String

from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.time import Duration, Time
from pipros_tools.bag import BagReader, BagWriter
from pipros_tools.bag.migration_rules import MigrationRule, parse_rules
from pipros_tools.graph.bus_info import statistics_of
from tests.support.bags import bag_bytes, old_bag_bytes, rows_of, some_rows
from tests.support.environments import genuine_environment, make_tool_folder, pipros_environment
from tests.support.ros import RosSystem, Side
from tests.support.same_results import printed
from tests.support.waiting import wait_until

PROGRAM = Path(__file__).parent / "programs" / "examine_bags.py"
GENUINE = "/usr/bin/python3"
NOWHERE = "http://127.0.0.1:1"


def run(home: Path, python: str, *arguments: str) -> str:
    """Return the output of the program or command."""
    if python == GENUINE:
        environment = genuine_environment(home, NOWHERE)
    else:
        tools = home / "tools"
        environment = pipros_environment(home, NOWHERE, tools if tools.exists() else make_tool_folder(tools))
    return printed(python, *arguments, environment=environment)


@pytest.mark.parametrize("writer", [GENUINE, sys.executable], ids=["genuine", "pipros"])
def test_random_bags_are_the_same_to_both(writer: str, tmp_path: Path) -> None:
    run(tmp_path, writer, str(PROGRAM), "write", str(tmp_path), "0", "120")
    files = sorted(map(str, tmp_path.glob("*.bag")))
    assert len(files) == 120

    told = [run(tmp_path, python, str(PROGRAM), "read", *files) for python in (GENUINE, sys.executable)]

    for file, genuine, ours in zip(files, *(text.splitlines() for text in told), strict=True):
        assert json.loads(ours) == json.loads(genuine), file


@pytest.mark.parametrize("mode", ["r", "a"])
@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_the_inner_names_that_viewers_use_give_the_same(compression: str, mode: str, tmp_path: Path) -> None:
    program = str(PROGRAM.with_name("examine_bag_index.py"))
    told = []
    for python in (GENUINE, sys.executable):
        file = tmp_path / "run.bag"
        file.write_bytes(bag_bytes(some_rows(40), compression=compression, chunk_bytes=150))
        told.append(json.loads(run(tmp_path, python, program, str(file), mode)))

    genuine, ours = told
    assert len(genuine["entries"]) == 40
    assert ours == genuine


def received(system: RosSystem, column: int) -> dict[str, int]:
    """Return what the subscriber of /number has read from each topic, by a column of its bus statistics."""
    master: Any = ServerProxy(system.master_uri)
    (node,) = system.subscribers("/number")
    api: Any = ServerProxy(master.lookupNode("/a_test", node)[2])
    topics = statistics_of(api.getBusStats("/a_test"))[1]
    for proxy in (api, master):
        proxy("close")()
    return {topic: sum(link[column] for link in links) for topic, links in topics}


@pytest.mark.parametrize("recorder", ["genuine", "pipros"])
def test_messages_played_by_one_are_recorded_by_the_other(recorder: str, plain_ros: RosSystem) -> None:
    # Fewer than the queues of genuine rosbag hold, which so lose nothing even if the other side pauses.
    rows: list[Any] = [("/number", Int32(n), 100 + n // 30, n % 30 * 1000) for n in range(90)]
    latched = ("/text", String("latched"), 99, 0)
    (plain_ros.home / "in.bag").write_bytes(bag_bytes([latched, *rows], compression="lz4", chunk_bytes=500))
    plain_ros.serve_master()
    recording, playing = plain_ros.pipros, plain_ros.genuine
    if recorder == "genuine":
        recording, playing = playing, recording
    record = recording.start("rosbag", "record", "-O", "out", "--lz4", "/number", "/text")
    plain_ros.wait_for_subscriber("/number")
    plain_ros.wait_for_subscriber("/text")

    # A stopped recorder discards unread messages, so the player keeps its links until they were read.
    play = ("rosbag", "play", "--wait-for-subscribers", "--hz", "50", "--clock", "--keep-alive", "in.bag")
    played = playing.start(*play)
    # The statistics of roscpp have the number of messages in them, those of pipros only that of bytes.
    column, number, text = (2, 90, 1) if recorder == "genuine" else (1, 90 * 8, 8 + len("latched"))
    everything = {"/number": number, "/text": text}
    wait_until(
        lambda: received(plain_ros, column) == everything, 60,
        lambda: f"{received(plain_ros, column)}: {played.output}",
    )  # fmt: skip
    played.press_ctrl_c()
    played.wait()
    record.press_ctrl_c()

    assert record.wait() == 0
    with BagReader(plain_ros.home / "out.bag") as bag:
        found = rows_of(bag)
    assert [row[1] for row in found if row[0] == "/number"] == list(range(90))
    assert [row[1] for row in found if row[0] == "/text"] == ["latched"]


def test_bags_of_format_1_2_are_described_alike(tmp_path: Path) -> None:
    """Current genuine rosbag cannot read the messages in such bags, but describes their contents."""
    file = tmp_path / "old.bag"
    file.write_bytes(old_bag_bytes(some_rows()))
    script = (
        f"import rosbag; bag = rosbag.Bag({str(file)!r}); print(bag, bag.version, bag.get_message_count())"
    )

    genuine, ours = (run(tmp_path, python, "-c", script) for python in (GENUINE, sys.executable))

    assert ours == genuine


# Our rosbag has every option of the genuine one, with the same letters and the same values.
COMMANDS = (
    *("check", "compress", "decompress", "decrypt", "encrypt", "filter", "fix", "info", "play", "record"),
    "reindex",
)
OURS = {**{name: {"--msgs"} for name in ("check", "filter", "fix", "info", "play")}, "record": {"--snapshot"}}
"""What pipros has besides."""


def options(side: Side, *argv: str) -> dict[str, tuple[frozenset[str], bool]]:
    """Return the options of a help text by each name: all their names, and whether a value follows."""
    done = side.run(*argv, "--help")
    assert done.returncode == 0, done.output
    found = {}
    for line in done.stdout:
        match = re.match(r" {2,4}(-\S.*?)(?: {2}|$)", line)
        if match is None:
            continue
        text = match[1].replace("[ ", ", ").replace(" ]", "")  # boost writes -h [ --help ]
        text = text.replace("[=arg", "")  # --split once took a size, and still accepts one
        names = frozenset(re.findall(r"(?<![\w-])--?[A-Za-z][\w-]*", text))
        takes_value = bool(re.search(r"=[A-Z]| [A-Z]| arg", text))
        found.update(dict.fromkeys(names, (names, takes_value)))
    return found


@pytest.mark.parametrize("command", COMMANDS)
def test_the_options_of_the_command_are_those_of_genuine_rosbag(command: str, plain_ros: RosSystem) -> None:
    genuine, ours = (
        options(plain_ros.genuine, "rosbag", command), options(plain_ros.pipros, "rosbag", command),
    )  # fmt: skip

    assert genuine
    assert {name: ours.get(name) for name in genuine} == genuine
    added = {"-L", "--min-space", "--topic"} if command == "record" else set()  # of the program record
    assert set(ours) - set(genuine) - added == OURS.get(command, set())


@pytest.mark.parametrize("program", ["play", "record"])
def test_the_options_of_the_programs_are_those_of_genuine_ones(program: str, plain_ros: RosSystem) -> None:
    genuine, ours = (
        options(plain_ros.genuine, f"/usr/lib/rosbag/{program}"),
        options(plain_ros.pipros, "rosbag", program),
    )

    for several in ("--topics", "--pause-topics"):  # take words up to the next option, like genuine ones
        assert genuine.pop(several, None) or program == "record"
    assert len(genuine) > 20
    assert {name: ours.get(name) for name in genuine} == genuine


# The rules of Debian's packages migrate messages as in genuine rosbag, which runs them.
FILE = Path("/usr/share/sensor_msgs/migration_rules/sensor_msgs.bmr")


def fill(message: Any, count: list[int]) -> None:
    """Give each field a different value."""
    classes = message_classes_from_text(message._type, message._full_text)
    for name, kind in zip(message.__slots__, message._slot_types, strict=True):
        base, _, length = kind.partition("[")

        def value(base: str = base) -> Any:
            count[0] += 1
            if base in classes:
                inner = classes[base]()
                fill(inner, count)
                return inner
            known = {"string": f"text {count[0]}", "bool": True, "time": Time(count[0], 7)}
            known["duration"] = Duration(count[0], 8)
            return known.get(base, float(count[0] % 100) if base.startswith("float") else count[0] % 100)

        size = int(length.rstrip("]") or 2) if length else 0
        if length and base in ("uint8", "char"):
            setattr(message, name, bytes(range(size)))
        else:
            setattr(message, name, [value() for _ in range(size)] if length else value())


def old_message(rule: MigrationRule) -> Any:
    """Return a message of the old definition of a rule."""
    message: Any = message_classes_from_text(rule.old[0], rule.old_text)[rule.old[0]]()
    fill(message, [0])
    if "depth" in message.__slots__:
        dimension = type(message.uint8_data.layout.dim[0])
        message.encoding, message.depth = "rgb", "uint8"
        message.uint8_data.data = bytes(18)
        sizes = [("height", 2, 18), ("width", 3, 9), ("channel", 3, 3)]
        message.uint8_data.layout.dim = [dimension(*each) for each in sizes]
    return message


def topic_of(rule: MigrationRule) -> str:
    return "/" + rule.name


def old_bag(rules: Sequence[MigrationRule]) -> bytes:
    """A bag with one message for each rule, on its own topic."""
    file = io.BytesIO()
    writer = BagWriter(file)
    for number, rule in enumerate(rules):
        topic = topic_of(rule)
        header = {"topic": topic, "type": rule.old[0], "md5sum": rule.old[1]}
        header["message_definition"] = rule.old_text
        connection = writer.add_connection(topic, {name: text.encode() for name, text in header.items()})
        writer.write_message(connection, 5 + number, 6, old_message(rule))
    writer.finish()
    return file.getvalue()


RULES = parse_rules(FILE.read_text(), str(FILE)) if FILE.exists() else []


def test_rules_of_packages_have_the_effect_of_genuine_rosbag(plain_ros: RosSystem) -> None:
    """All migrations use one bag, because starting genuine rosbag takes longer than all of them."""
    assert len(RULES) > 10
    (plain_ros.home / "old.bag").write_bytes(old_bag(RULES))
    found: list[dict[str, Any]] = []
    for side, name in ((plain_ros.genuine, "genuine.bag"), (plain_ros.pipros, "pipros_tools.bag")):
        done = side.run("rosbag", "fix", "-n", "old.bag", name, FILE)
        assert (done.returncode, done.stdout) == (0, ["Bag migrated successfully."])
        with BagReader(plain_ros.home / name) as bag:
            messages = list(bag.raw_messages())
        assert len(messages) == len(RULES)
        found.append({each[0].topic: (each[0].type, each[0].md5sum, *each[1:4]) for each in messages})

    genuine, ours = found
    in_place = plain_ros.pipros.run("rosbag", "fix", "-n", "pipros_tools.bag", "pipros_tools.bag", FILE)
    assert (in_place.returncode, in_place.stdout) == (0, ["Bag migrated successfully."])
    with BagReader(plain_ros.home / "pipros_tools.bag") as bag:
        assert {
            each[0].topic: (each[0].type, each[0].md5sum, *each[1:4]) for each in bag.raw_messages()
        } == ours
    assert genuine.keys() == {topic_of(rule) for rule in RULES}
    for rule in RULES:
        assert ours[topic_of(rule)] == genuine[topic_of(rule)], rule.name
