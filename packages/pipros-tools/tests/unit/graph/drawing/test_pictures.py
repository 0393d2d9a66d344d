"""DOT, SVG and PNG of a graph."""

import io
import re
import sys
from xml.etree import ElementTree

import pytest
from PIL import Image

from pipros.basics.extras import install_command
from pipros_tools.graph.drawing.dot import to_dot
from pipros_tools.graph.drawing.node_graph import GraphOptions, NodeGraph, node_graph
from pipros_tools.graph.drawing.pdf import to_pdf
from pipros_tools.graph.drawing.png import PictureFailed, to_png
from pipros_tools.graph.drawing.scene import Scene, draw
from pipros_tools.graph.drawing.svg import to_svg
from pipros_tools.graph.system_state import SystemState, TopicConnection
from tf.nodes.view_frames import scene_of

SVG = "{http://www.w3.org/2000/svg}"
EVIL = '/a"]; evil [label="<script>'


def graph_of(topic: str = "/battery_topic", mode: str = "active") -> NodeGraph:
    state = SystemState({topic: ["/ns/talker"]}, {topic: ["/ns/listener"]}, {})
    options = GraphOptions(mode)  # type: ignore[arg-type]
    return node_graph(
        state, [TopicConnection("/ns/talker", topic, "/ns/listener")], ["/ns/listener"], options
    )


def parsed(scene: Scene) -> ElementTree.Element:
    return ElementTree.fromstring(to_svg(scene))  # noqa: S314 - written just now


def test_svg_has_nodes_topics_arrows_and_namespaces() -> None:
    drawing = parsed(draw(graph_of()))
    assert [text.text for text in drawing.iter(f"{SVG}text")] == [
        "/ns", "listener", "talker", "/battery_topic",
    ]  # fmt: skip
    assert len(list(drawing.iter(f"{SVG}ellipse"))) == 2
    assert [shape.get("class") for shape in drawing.iter(f"{SVG}rect")] == ["band", "topic"]
    assert len([path for path in drawing.iter(f"{SVG}path") if path.get("class") == "arrow"]) == 2
    assert "node unreachable" in {shape.get("class") for shape in drawing.iter(f"{SVG}ellipse")}


def test_a_name_with_markup_stays_text() -> None:
    drawing = parsed(draw(graph_of(EVIL)))
    assert EVIL in {text.text for text in drawing.iter(f"{SVG}text")}
    assert not list(drawing.iter(f"{SVG}script"))
    assert r'label="/a\"]; evil [label=\"<script>"' in to_dot(graph_of(EVIL))


def test_dot_has_clusters_and_labels_where_there_are_no_topics() -> None:
    assert 'subgraph "cluster_/ns" {' in to_dot(graph_of())
    assert '"node /ns/talker" -> "node /ns/listener" [label="/battery_topic"];' in to_dot(
        graph_of(mode="nodes")
    )


def test_png_is_a_picture_of_twice_the_size() -> None:
    scene = draw(graph_of())
    with Image.open(io.BytesIO(to_png(scene))) as image:
        assert image.size == (round(scene.width * 4) // 2, round(scene.height * 4) // 2)
        colours = image.convert("RGB").getcolors(1 << 20) or []
        assert len(colours) > 20


def test_a_png_that_is_too_large_is_refused() -> None:
    with pytest.raises(PictureFailed, match="too large for PNG"):
        to_png(Scene(width=10_000, height=10_000))


def test_without_pillow_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(PictureFailed, match=re.escape(install_command("pictures"))):
        to_png(draw(graph_of()))


def test_several_topics_between_two_nodes_share_an_arrow() -> None:
    state = SystemState({"/x": ["/a"], "/y": ["/a"]}, {"/x": ["/b"], "/y": ["/b"]}, {})
    connections = [TopicConnection("/a", topic, "/b") for topic in ("/x", "/y")]
    scene = draw(node_graph(state, connections, options=GraphOptions("nodes")))
    assert [text for _, _, text in scene.arrows] == ["/x +1"]


def test_an_empty_graph_can_be_drawn() -> None:
    drawing = parsed(draw(NodeGraph()))
    assert drawing.tag == f"{SVG}svg"
    assert not list(drawing.iter(f"{SVG}text"))


def test_a_vertical_drawing_leads_downwards_and_keeps_the_sizes_of_boxes() -> None:
    graph = graph_of()
    flat, upright = draw(graph, with_traffic=True), draw(graph, with_traffic=True, is_vertical=True)
    sizes = {vertex.key: (box.width, box.height) for vertex, box, _ in flat.boxes}
    places = {vertex.key: box for vertex, box, _ in upright.boxes}
    assert {key: (box.width, box.height) for key, box in places.items()} == sizes
    for arrow, route, _ in upright.arrows:
        assert places[arrow.start].y < places[arrow.end].y
        assert route[0][1] < route[-1][1]
    assert upright.width < flat.width


# Drawings as PDF.


TREE = [
    ("map", "odom", "/slam", 20.0), ("odom", "base", "/wheels", 50.0), ("base", "arm (left)\\", "/urdf", 1e4)
]  # fmt: skip


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
