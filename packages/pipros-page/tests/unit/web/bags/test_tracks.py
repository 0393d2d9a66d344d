"""Tracks of a timeline, from the indexes of bags."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from pipros.msg import load_message_class
from pipros_page.bags.tracks import BINS, tracks
from pipros_tools.bag.opening import open_bag, writer_for


@pytest.mark.parametrize("name", ["one.bag", "one.mcap"])
def test_a_single_chunk_has_a_visible_track(tmp_path: Path, name: str) -> None:
    kind = load_message_class("std_msgs/Float64")
    fields = {"type": kind._type, "md5sum": kind._md5sum, "message_definition": kind._full_text}
    with (tmp_path / name).open("wb") as file:
        writer = writer_for(name, file)
        number = writer.add_connection("/number", {key: text.encode() for key, text in fields.items()})
        for second in range(1000, 2000):
            writer.write(number, second, 0, struct.pack("<d", second))
        writer.finish()
    with open_bag(tmp_path / name) as bag:
        (track,) = tracks(bag)
    assert (track.topic, track.count, len(track.bins)) == ("/number", 1000, BINS)
    assert all(track.bins)
