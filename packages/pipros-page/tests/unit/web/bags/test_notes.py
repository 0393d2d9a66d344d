"""Notes beside a bag."""

from __future__ import annotations

import asyncio
import contextlib
import os
from pathlib import Path

import pytest

from pipros.node import Node
from pipros_page.bags.folder import BagFolder
from pipros_page.bags.notes import LONGEST_TEXT, PAGE_NOTES_BYTES, BadNotes, BagNotes, Note
from pipros_page.bags.open_bags import OpenBags
from pipros_page.views.bags import BagViews
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused
from pipros_tools.graph.client import GraphClient


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
        with pytest.raises(RequestRefused, match=r"there is no bag \[no.bag\]"):
            await own.add_note({"name": "no.bag", **note})
        with pytest.raises(BadNotes, match="time of a note must be a number"):
            await own.add_note({"name": "run.bag", "text": "here"})
        assert await own.remove_note({"name": "run.bag", **note}) == []

    asyncio.run(check())
