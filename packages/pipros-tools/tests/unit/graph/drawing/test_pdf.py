"""Drawings as PDF."""

from __future__ import annotations

import re

import pytest

from pipros_tools.graph.drawing.pdf import to_pdf
from pipros_tools.graph.drawing.scene import Scene
from tf.nodes.view_frames import scene_of

TREE = [
    ("map", "odom", "/slam", 20.0),
    ("odom", "base", "/wheels", 50.0),
    ("base", "arm (left)\\", "/urdf", 1e4),
]


def test_every_object_is_where_the_table_says() -> None:
    document = to_pdf(scene_of(TREE))

    start = int(re.findall(rb"startxref\n(\d+)\n%%EOF\n$", document)[0])
    assert document[start:].startswith(b"xref\n0 6\n")
    places = [int(place) for place in re.findall(rb"(\d{10}) 00000 n", document)]
    assert [document[place:].split(b" ", 1)[0] for place in places] == [b"1", b"2", b"3", b"4", b"5"]
    length = int(re.findall(rb"/Length (\d+)", document)[0])
    stream = document.partition(b"stream\n")[2]
    assert stream[length:].startswith(b"\nendstream")


def test_names_with_brackets_are_texts() -> None:
    document = to_pdf(scene_of(TREE))

    assert rb"(arm \(left\)\\) Tj" in document
    assert b"(50.0 Hz /wheels) Tj" in document
    assert b"(?) Tj" in to_pdf(scene_of([("\N{SNOWMAN}", "b", "", 1.0)]))


def test_an_empty_graph_can_be_written_as_pdf() -> None:
    assert to_pdf(Scene()).startswith(b"%PDF-1.4")
    assert scene_of([]).boxes == []


@pytest.mark.parametrize("edges", [[("a", "b", "", 1.0), ("b", "a", "", 1.0)], [("a", "a", "", 1.0)]])
def test_cyclic_graphs_are_drawn(edges: list[tuple[str, str, str, float]]) -> None:
    assert to_pdf(scene_of(edges)).count(b" S\n") >= 1
