"""Notes beside a bag."""

import asyncio
import contextlib
import io
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rosgraph_msgs.msg import Log
from std_msgs.msg import Float64, String

from pipros.node import Node
from pipros_page.bags.folder import BagFolder
from pipros_page.bags.marks import BINS, MARKS_OF_A_BIN, MAX_COMPONENTS, BagMarks, Mark
from pipros_page.bags.notes import LONGEST_TEXT, PAGE_NOTES_BYTES, BadNotes, BagNotes, Note
from pipros_page.bags.open_bags import OpenBags
from pipros_page.views.bags import BagViews
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused
from pipros_tools.bag import BagReader
from pipros_tools.graph.client import GraphClient
from tests.support.bags import bag_bytes


@pytest.fixture
def notes(tmp_path: Path) -> BagNotes:
    return BagNotes(tmp_path / "run.bag")


def test_notes_are_kept_in_a_file_beside_the_bag_in_the_order_of_time(notes: BagNotes) -> None:
    late, early = Note(1012.25, "the wheel slips: ä #1"), Note(1001, "begin")
    assert notes.read() == []
    notes.add(late)
    assert notes.add(early) == notes.read() == [early, late]
    assert notes.path.name == "run.bag.notes.yaml"
    assert notes.path.read_text(encoding="utf-8") == (
        "notes:\n- time: 1001\n  text: begin\n- time: 1012.25\n  text: 'the wheel slips: ä #1'\n"
    )
    assert notes.remove(early) == notes.read() == [late]
    with pytest.raises(BadNotes, match="the note does not exist"):
        notes.remove(early)


@pytest.mark.parametrize(("time", "text"), [
    ("1", "a"), (True, "a"), (-1, "a"), (float("nan"), "a"), (1, ""), (1, " "), (1, None),
    (1, "a" * (LONGEST_TEXT + 1)), (1, "a\ud800"),
])  # fmt: skip
def test_invalid_notes_are_refused(time: float, text: str) -> None:
    with pytest.raises(BadNotes, match=r"must (be|have)"):
        Note(time, text)


@pytest.mark.parametrize("content", [
    b"[", b"notes: 5", b"a: 1", b"notes: []\nmore: 1", b"notes: [5]", b"notes: [{time: 1}]",
    b"\xff\xfe\xff", b"", b"notes: [{time: 1, text: a, who: me}]", b"notes: [{time: x, text: a}]",
])  # fmt: skip
def test_a_file_that_is_not_one_of_notes_is_never_replaced(notes: BagNotes, content: bytes) -> None:
    notes.path.write_bytes(content)
    for use in (notes.read, lambda: notes.add(Note(1, "a")), lambda: notes.remove(Note(1, "a"))):
        with pytest.raises(BadNotes, match=rf"{notes.path} is not a file of notes: .*Correct or move it"):
            use()
    assert notes.path.read_bytes() == content


def test_a_link_and_a_folder_are_not_read(notes: BagNotes, tmp_path: Path) -> None:
    (tmp_path / "other.yaml").write_text("notes: []")
    notes.path.symlink_to(tmp_path / "other.yaml")
    with pytest.raises(BadNotes, match="is not a regular file"):
        notes.add(Note(1, "a"))
    notes.path.unlink()
    notes.path.mkdir()
    with pytest.raises(BadNotes, match="is not a regular file"):
        notes.read()


def test_notes_have_a_limit(notes: BagNotes) -> None:
    limit = PAGE_NOTES_BYTES
    notes.path.write_bytes(b"notes: []" + b" " * limit)
    with pytest.raises(BadNotes, match=f"is too large; the limit is {limit}"):
        notes.read()
    notes.path.unlink()
    text = "x" * LONGEST_TEXT
    rows = "".join(f"- time: {at}\n  text: {text}\n" for at in range(limit // (LONGEST_TEXT + 30)))
    notes.path.write_text(f"notes:\n{rows}")
    kept = notes.read()
    for _ in range(2):  # the first one may fit
        with contextlib.suppress(BadNotes):
            kept = notes.add(Note(1, text))
    with pytest.raises(BadNotes, match=f"would be too large; the limit is {limit}"):
        notes.add(Note(1, text))
    assert notes.read() == kept


def test_a_note_that_cannot_be_written_names_the_file_and_leaves_the_old_one(notes: BagNotes) -> None:
    notes.add(Note(1, "a"))
    blocking = notes.path.with_name(f"{notes.path.name}.active")
    if os.geteuid():
        notes.path.parent.chmod(0o500)
    else:
        blocking.mkdir()  # root may write to any folder
    with pytest.raises(BadNotes, match=rf"cannot write {notes.path}: \S"):
        notes.add(Note(2, "b"))
    notes.path.parent.chmod(0o700)
    assert notes.read() == [Note(1, "a")]


def test_a_page_writes_notes_only_if_it_may_and_only_beside_bags_of_its_folder(tmp_path: Path) -> None:
    (tmp_path / "run.bag").write_bytes(b"")
    system = WatchedSystem(GraphClient("test"), Node("test"))
    own, other = (
        BagViews(system, BagFolder(tmp_path), OpenBags(), may_note=may_note) for may_note in (True, False)
    )
    note = {"time": 1.5, "text": "here"}

    async def check() -> None:
        assert await own.add_note({"name": "run.bag", **note}) == [note]
        with pytest.raises(RequestRefused, match="may not write notes; start it with --control"):
            await other.add_note({"name": "run.bag", **note})
        with pytest.raises(RequestRefused, match=r"no file \[no.bag\] below this folder"):
            await own.add_note({"name": "no.bag", **note})
        with pytest.raises(BadNotes, match="time of a note must be a number"):
            await own.add_note({"name": "run.bag", "text": "here"})
        assert await own.remove_note({"name": "run.bag", **note}) == []

    asyncio.run(check())


# The marks of a bag's timeline.


def marks_of(messages: Iterable[tuple[str, Any, int, int]]) -> tuple[list[Mark], int]:
    """Return the marks of a bag, and the number of those that were left out."""
    with BagReader(io.BytesIO(bag_bytes(list(messages)))) as reader:
        marks, found = BagMarks(reader), []
        while (piece := marks.next_piece()) is not None:
            found += piece
        return found, marks.left_out


def log(second: int, level: int, text: str, topic: str = "/rosout") -> tuple[str, Any, int, int]:
    entry = Log(level=level, name="/robot", msg=text)
    entry.header.frame_id = "a frame"
    return topic, entry, second, 0


def status(
    second: int, level: int, topic: str = "/diagnostics", name: str = "motor"
) -> tuple[str, Any, int, int]:
    return topic, DiagnosticArray(status=[DiagnosticStatus(level, name, f"level {level}", "", [])]), second, 0


def test_errors_of_the_log_are_marked_and_warnings_are_not() -> None:
    found, _ = marks_of([log(1, 1, "debug"), log(2, 4, "warn"), log(3, 8, "error"), log(4, 16, "fatal")])
    assert found == [(3.0, "log", "/robot: error"), (4.0, "log", "/robot: fatal")]


def test_diagnostics_are_marked_when_they_get_worse() -> None:
    found, _ = marks_of([status(second, level) for second, level in enumerate((0, 1, 1, 2, 1, 2, 0, 3, 7))])
    assert [(time, kind) for time, kind, _ in found] == [
        (1, "warning"), (3, "error"), (5, "error"), (7, "stale"),
    ]  # fmt: skip
    assert found[0][2] == "motor: level 1"


def test_entries_and_diagnostics_that_were_published_again_count_once() -> None:
    found, _ = marks_of(
        [log(1, 8, "error"), log(1, 8, "error", "/rosout_agg"), status(2, 2),
            status(2, 2, "/diagnostics_agg")],
    )  # fmt: skip
    assert [kind for _, kind, _ in found] == ["log", "error"]


def test_many_marks_are_spread_over_the_bag_and_equal_ones_are_one() -> None:
    burst = [log(1, 8, f"error {number}") for number in range(100)]
    found, left_out = marks_of(
        [*burst, *(log(1, 8, "error 0") for _ in range(50)), log(BINS * 10, 8, "last")]
    )
    assert len(found) == MARKS_OF_A_BIN + 1
    assert found[-1][2] == "/robot: last"
    assert left_out == 100 - MARKS_OF_A_BIN


def test_topics_of_other_types_and_long_texts_do_no_harm() -> None:
    assert marks_of([("/rosout", Float64(1), 1, 0), ("/diagnostics", Float64(1), 1, 0)]) == ([], 0)
    assert marks_of([("/rosout", String("x" * 300), 1, 0)]) == ([], 0)
    [(_, _, text)], _ = marks_of([log(2, 8, "x" * 100_000)])
    assert len(text) == 200


def test_the_number_of_components_is_limited() -> None:
    many = DiagnosticArray(
        status=[DiagnosticStatus(0, f"{number}", "", "", []) for number in range(MAX_COMPONENTS)]
    )
    found, _ = marks_of([("/diagnostics", many, 1, 0), status(2, 2, name="one more"), status(3, 2, name="5")])
    assert [text for _, _, text in found] == ["5: level 2"]
