"""Bags of either side are read by both, with the same results."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import pytest
from std_msgs.msg import Int32, String

from pipros_tools.bag import BagReader
from pipros_tools.graph.bus_info import statistics_of
from tests.support.bags import bag_bytes, old_bag_bytes, rows_of, some_rows
from tests.support.environments import genuine_environment, make_tool_folder, pipros_environment
from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem
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
    done = subprocess.run([python, *arguments], env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.timeout(600)
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


@pytest.fixture
def sides(claimed_port: ClaimedPort, tmp_path: Path, bare_tools: Path) -> Iterator[RosSystem]:
    """Both sides without a workspace, which recording and playing do not need."""
    system = RosSystem(claimed_port.number, tmp_path, bare_tools)
    yield system
    system.close()


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
def test_messages_played_by_one_are_recorded_by_the_other(recorder: str, sides: RosSystem) -> None:
    # Fewer than the queues of genuine rosbag hold, which so lose nothing even if the other side pauses.
    rows: list[Any] = [("/number", Int32(n), 100 + n // 30, n % 30 * 1000) for n in range(90)]
    latched = ("/text", String("latched"), 99, 0)
    (sides.home / "in.bag").write_bytes(bag_bytes([latched, *rows], compression="lz4", chunk_bytes=500))
    sides.pipros.start_master()
    recording, playing = sides.pipros, sides.genuine
    if recorder == "genuine":
        recording, playing = playing, recording
    record = recording.start("rosbag", "record", "-O", "out", "--lz4", "/number", "/text")
    sides.wait_for_subscriber("/number")
    sides.wait_for_subscriber("/text")

    # A stopped recorder discards unread messages, so the player keeps its links until they were read.
    play = ("rosbag", "play", "--wait-for-subscribers", "--hz", "50", "--clock", "--keep-alive", "in.bag")
    played = playing.start(*play)
    # The statistics of roscpp have the number of messages in them, those of pipros only that of bytes.
    column, number, text = (2, 90, 1) if recorder == "genuine" else (1, 90 * 8, 8 + len("latched"))
    everything = {"/number": number, "/text": text}
    wait_until(
        lambda: received(sides, column) == everything,
        60,
        lambda: f"{received(sides, column)}: {played.output}",
    )
    played.press_ctrl_c()
    played.wait()
    record.press_ctrl_c()

    assert record.wait() == 0
    with BagReader(sides.home / "out.bag") as bag:
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
