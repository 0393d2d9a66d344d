"""The recorder's thread and its limits, with a link that the tests simulate."""

import json
import logging
import os
import struct
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.budget import SharedBudget
from pipros.basics.limits import process_limits
from pipros.msg import load_message_class
from pipros_fleet import keys
from pipros_fleet.directory import Directory, DirectoryEntry, to_json
from pipros_fleet.history_files import FILE_BYTES, SMALLEST_LIMIT_BYTES, HistoryFile, HistoryFiles
from pipros_fleet.limits import FleetLimits
from pipros_fleet.messages import MessageAttachment, pack
from pipros_fleet.recorder import FleetRecorder
from pipros_fleet.zenoh_session import FleetAnswer
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.opening import open_bag
from tests.support.constants import Constants
from tests.support.waiting import wait_until

DEADLINE_S = 60
MD5 = "0123456789abcdef" * 2
RUN = "00" * 8
String: Any = load_message_class("std_msgs/String")


class FakeQuestion:
    """Request whose answer is stored."""

    def __init__(self, key: str, asker: str = "operator") -> None:
        self.key, self.asker = key, asker
        self.answers: list[bytes] = []
        self.refusal = ""
        self.is_closed = False

    def answer(self, payload: bytes) -> None:
        self.answers.append(payload)

    def refuse(self, reason: str) -> None:
        self.refusal = reason

    def close(self) -> None:
        self.is_closed = True


class FakeLink:
    """Link whose other members are simulated by the test.

    Attributes:
        answers: payloads that members answer, by key.
        wanted: the topics that the recorder requested last, by member.
    """

    def __init__(self) -> None:
        self.answers: dict[str, bytes] = {}
        self.wanted: dict[str, list[str]] = {}
        self._served: dict[str, Callable[..., object]] = {}
        self._subscribers: dict[str, Callable[..., object]] = {}
        self._on_token: Callable[[str, bool], object] = print

    def serve(self, pattern: str, on_question: Callable[..., object]) -> None:
        self._served[pattern] = on_question

    def ask(self, pattern: str, question: FakeQuestion) -> None:
        """Simulate a member that sends a request."""
        self._served[pattern](question)

    def subscribe(self, pattern: str, on_message: Callable[..., object]) -> None:
        self._subscribers[pattern] = on_message

    def declare_token(self, key: str) -> None:
        del key

    def watch_tokens(self, pattern: str, on_change: Callable[[str, bool], object]) -> None:
        del pattern
        self._on_token = on_change

    def get(self, key: str, **_: object) -> list[FleetAnswer]:
        return [FleetAnswer(key, self.answers[key], b"")] if key in self.answers else []

    def put(self, key: str, payload: bytes, **_: object) -> None:
        self.wanted[key.rpartition("/")[2]] = json.loads(payload)["topics"]

    def join(self, member: str, *entries: DirectoryEntry) -> None:
        """Simulate a member that joins and sends its directory."""
        self._on_token(keys.live(member, keys.VERSION, RUN), True)
        self.send_directory(member, *entries)

    def leave(self, member: str) -> None:
        self._on_token(keys.live(member, keys.VERSION, RUN), False)

    def send_directory(self, member: str, *entries: DirectoryEntry) -> None:
        payload = to_json(Directory(member, RUN, 1, entries))
        self.answers[keys.directory(member)] = payload
        self._subscribers[keys.directory("*")](keys.directory(member), payload, b"")

    def send(self, member: str, entry: DirectoryEntry, sequence: int, body: bytes, **flags: bool) -> None:
        """Simulate a member that sends a message."""
        attachment = pack(MessageAttachment(0, RUN, sequence, 0, entry.md5sum, **flags))
        self._subscribers[keys.topic("*", keys.EVERY)](keys.topic(member, entry.name), body, attachment)


@pytest.fixture
def link() -> FakeLink:
    return FakeLink()


class Files(HistoryFiles):
    """Files that cannot be written for one member.

    Attributes:
        can_list: event for which `list` waits.
        written: number of messages written.
    """

    broken = ""
    written = 0

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, SMALLEST_LIMIT_BYTES)
        self.can_list = threading.Event()

    def list(self, member: str) -> list[HistoryFile]:
        self.can_list.wait(DEADLINE_S)
        return super().list(member)

    def write(self, member: str, connection: Connection, time_ns: int, data: bytes) -> None:
        if member == self.broken:
            raise struct.error("cannot pack")
        super().write(member, connection, time_ns, data)
        self.written += 1


@pytest.fixture
def files(tmp_path: Path) -> Files:
    return Files(tmp_path)


@pytest.fixture
def recorder(link: FakeLink, files: Files, constants: Constants) -> Iterator[FleetRecorder]:
    constants(FLEET_MEMBERS=2, FLEET_TOPICS=12, FLEET_DEFINITION_BYTES=5000)
    limits = process_limits().with_table(FleetLimits())
    log = logging.getLogger("test")
    found = FleetRecorder(link, files, "11" * 8, ["/**"], log=log, limits=limits)  # type: ignore[arg-type]
    found.start()
    yield found
    found.close()


def recorded(folder: Path) -> list[str]:
    """Return the texts in a folder's complete files."""
    found = []
    for path in sorted(folder.glob("*.mcap")):
        with open_bag(path) as bag:
            found += [each.message.data for each in bag.messages()]
    return found


def body(text: str) -> bytes:
    return b"".join(String(text)._to_buffers())


TALK = DirectoryEntry("/talk", "std_msgs/String", String._md5sum)


def test_a_definition_with_lone_surrogates_is_ignored(
    link: FakeLink, recorder: FleetRecorder, files: Files, tmp_path: Path
) -> None:
    strange = DirectoryEntry("/strange", "a/Strange", MD5)
    link.answers[keys.definition("robot1", "a/Strange")] = json.dumps([MD5, "\ud800"]).encode()
    link.join("robot1", strange)
    link.join("robot2", TALK)
    wait_until(lambda: link.wanted == {"robot1": ["/strange"], "robot2": ["/talk"]}, DEADLINE_S, "requests")
    link.send("robot1", strange, 1, b"x")
    link.send("robot2", TALK, 1, body("hello"))
    wait_until(lambda: files.written == 2, DEADLINE_S, "both messages")
    recorder.close()
    assert (recorded(tmp_path / "robot2"), len(list((tmp_path / "robot1").iterdir()))) == (["hello"], 1)


def test_an_unexpected_error_ends_no_recording_and_is_logged_once(
    link: FakeLink, recorder: FleetRecorder, files: Files, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    files.broken = "robot1"
    link.join("robot1", TALK)
    link.join("robot2", TALK)
    wait_until(lambda: link.wanted == {"robot1": ["/talk"], "robot2": ["/talk"]}, DEADLINE_S, "requests")
    for sequence in (1, 2):
        link.send("robot1", TALK, sequence, body("lost"))
        link.send("robot2", TALK, sequence, body(f"kept {sequence}"))
    wait_until(lambda: files.written == 2, DEADLINE_S, "the messages of the other member")
    recorder.close()
    assert recorded(tmp_path / "robot2") == ["kept 1", "kept 2"]
    assert caplog.messages == ["the history is incomplete: cannot pack"]


def test_a_message_that_takes_long_to_decompress_delays_no_other_member(
    link: FakeLink, recorder: FleetRecorder, files: Files, monkeypatch: pytest.MonkeyPatch
) -> None:
    gate = threading.Event()
    monkeypatch.setattr(
        "pipros_fleet.recorder.decompressed", lambda *_: (gate.wait(DEADLINE_S), body("big"))[1]
    )
    link.join("robot1", TALK)
    link.join("robot2", TALK)
    wait_until(lambda: len(link.wanted) == 2, DEADLINE_S, "requests")
    link.send("robot1", TALK, 1, b"", is_compressed=True)
    link.send("robot2", TALK, 1, body("hello"))
    wait_until(lambda: files.written == 1, DEADLINE_S, "the message of the other member")
    gate.set()
    wait_until(lambda: files.written == 2, DEADLINE_S, "both messages")
    assert recorder.dropped == 0


def test_latched_messages_leave_room_in_the_files(
    link: FakeLink, recorder: FleetRecorder, files: Files, tmp_path: Path
) -> None:
    maps = [DirectoryEntry(f"/map{number}", "std_msgs/String", String._md5sum) for number in range(4)]
    link.join("robot1", *maps, TALK)
    link.join("robot2", TALK)
    wait_until(lambda: sum(map(len, link.wanted.values())) == 6, DEADLINE_S, "requests")
    big = os.urandom(FILE_BYTES // 6).hex()  # lz4 cannot compress it
    for entry in maps:
        link.send("robot1", entry, 1, body(big), is_latched=True)
    link.send("robot2", TALK, 1, body("latched"), is_latched=True)
    for sequence in range(1, 11):
        link.send("robot1", TALK, sequence, body("small"))
        wait_until(lambda count=sequence: files.written == 5 + count, DEADLINE_S, "a message")
    assert len(list((tmp_path / "robot1").iterdir())) <= 2
    files.can_list.set()
    assert [each.messages for each in files.list("robot2")] == [1]
    link.send("robot2", TALK, 2, body("later"))
    wait_until(lambda: files.written == 16, DEADLINE_S, "a later message")
    recorder.close()
    assert sorted(recorded(tmp_path / "robot2")) == ["latched", "latched", "later"]


def test_empty_messages_of_a_member_use_only_its_share_of_the_queue(recorder: FleetRecorder) -> None:
    recorder._waiting_bytes = SharedBudget(100_000)
    recorder.close()  # nothing takes messages from the queue any more
    for number in range(200):
        recorder._on_message(f"pipros/bad/t/{number}", b"", b"")
    assert recorder.dropped > 100
    recorder._on_message("pipros/good/t/talk", b"", b"")
    assert [each[0] for each in iter(recorder._next_message, None)][1] == "pipros/good/t/talk"


def test_surplus_requests_for_the_history_are_refused(
    link: FakeLink, recorder: FleetRecorder, files: Files
) -> None:
    questions = [FakeQuestion(keys.history("robot1"), "bad") for _ in range(40)]
    for question in questions:
        link.ask(keys.history("*"), question)
    other = FakeQuestion(keys.history("robot1"))
    link.ask(keys.history("*"), other)
    assert not other.is_closed, "it waits for its turn"
    assert [each.is_closed for each in questions] == 32 * [False] + 8 * [True]
    reason = "the router has too many requests for its history; try again later"
    assert {each.refusal for each in questions[32:]} == {reason}
    files.can_list.set()
    wait_until(lambda: all(each.is_closed for each in [other, *questions]), DEADLINE_S, "the answers")
    assert other.answers == [b"[]"]
    assert all(each.answers == [b"[]"] for each in questions[:32])
    wait_until(lambda: _answered(link), DEADLINE_S, "room for another request")


def _answered(link: FakeLink) -> bool:
    question = FakeQuestion(keys.history("robot1"))
    link.ask(keys.history("*"), question)
    wait_until(lambda: question.is_closed, DEADLINE_S, "an answer")
    return question.answers == [b"[]"]


@pytest.mark.usefixtures("recorder")
def test_a_member_that_leaves_is_forgotten(link: FakeLink, files: Files, tmp_path: Path, caplog) -> None:
    for number in range(5):
        member = f"robot{number}"
        link.join(member, TALK)
        wait_until(lambda member=member: link.wanted.get(member) == ["/talk"], DEADLINE_S, "a request")
        link.send(member, TALK, 1, body("hello"), is_latched=True)
        wait_until(lambda number=number: files.written == number + 1, DEADLINE_S, "the message")
        link.leave(member)
        wait_until(lambda member=member: recorded(tmp_path / member) == ["hello"], DEADLINE_S, "its file")
    assert not caplog.messages


def test_topics_that_a_member_withdraws_are_forgotten(
    link: FakeLink, recorder: FleetRecorder, files: Files, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    large = os.urandom(FILE_BYTES // 12).hex()  # two of them are too large to be repeated
    for number in range(10):
        entry = DirectoryEntry(f"/map{number}", "std_msgs/String", String._md5sum)
        link.join("robot1", entry)
        wait_until(lambda name=entry.name: link.wanted.get("robot1") == [name], DEADLINE_S, "a request")
        link.send("robot1", entry, 1, body(f"{number} {large}"), is_latched=True)
        wait_until(lambda number=number: files.written == number + 1, DEADLINE_S, "the message")
    files.can_list.set()
    before = {each.name for each in files.list("robot1")}
    link.send("robot1", entry, 2, body("last"))
    wait_until(lambda: files.written == 11, DEADLINE_S, "the message")
    recorder.close()
    for name in before:
        (tmp_path / "robot1" / name).unlink()
    assert [each.partition(" ")[0] for each in recorded(tmp_path / "robot1")] == ["9", "last"]
    assert not caplog.messages


def test_directories_of_members_without_a_token_are_ignored(link: FakeLink, recorder: FleetRecorder) -> None:
    link.send_directory("ghost", TALK)
    link.join("robot1", TALK)
    wait_until(lambda: link.wanted.get("robot1") == ["/talk"], DEADLINE_S, "a request")
    recorder.close()
    assert link.wanted == {"robot1": ["/talk"]}


def test_surplus_members_are_reported(link: FakeLink, recorder: FleetRecorder, caplog) -> None:
    for number in range(3):
        link.join(f"robot{number}", TALK)
    wait_until(lambda: len(link.wanted) == 2 and caplog.messages, DEADLINE_S, "the warning")
    recorder.close()
    assert link.wanted.keys() == {"robot0", "robot1"}
    assert [each.partition(";")[0] for each in caplog.messages] == ["too many members"]


def test_definitions_of_all_members_together_are_limited(
    link: FakeLink, recorder: FleetRecorder, files: Files, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    strange, text = DirectoryEntry("/strange", "a/Strange", MD5), "string data # " + 3000 * "x"
    content = json.dumps([MD5, text]).encode()

    def definition_of(member: str) -> str:
        """Let a member share the topic. Return the recorded definition."""
        link.answers[keys.definition(member, "a/Strange")] = content
        link.join(member, strange)
        wait_until(lambda: link.wanted.get(member) == ["/strange"], DEADLINE_S, "a request")
        before = files.written
        link.send(member, strange, 1, b"x")
        wait_until(lambda: files.written == before + 1, DEADLINE_S, "the message")
        files.can_list.set()
        wait_until(lambda: files.list(member), DEADLINE_S, "the file")
        (path,) = (tmp_path / member).glob("*.mcap")
        with open_bag(path) as bag:
            (connection,) = bag.connections
            return connection.header["message_definition"].decode()

    assert (definition_of("robot1"), definition_of("robot2")) == (text, "")
    assert [each.partition(";")[0] for each in caplog.messages] == ["too many definitions of members"]
    link.send_directory("robot1")
    link.leave("robot2")
    wait_until(lambda: link.wanted["robot1"] == [], DEADLINE_S, "the withdrawal")
    assert definition_of("robot3") == text
