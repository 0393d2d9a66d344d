"""Browsers with the same options share one drawing."""

import asyncio
import random
from dataclasses import replace
from unittest.mock import Mock

import pytest

from pipros_page import graph_drawings
from pipros_page.graph_drawings import GraphDrawings
from pipros_page.views.graph_values import LABEL_HEIGHT, LETTER, label_letters, overlap, scene_values
from pipros_tools.graph.drawing.layered_layout import Box
from pipros_tools.graph.drawing.node_graph import GraphOptions, Key, NodeGraph, node_graph
from pipros_tools.graph.drawing.scene import Scene
from pipros_tools.graph.drawing.scene import draw as draw_scene
from pipros_tools.graph.observer import GraphObservation, ObservedNode, Traffic
from pipros_tools.graph.system_state import SystemState, TopicConnection
from pipros_tools.graph.wrong_types import WrongTypes


def observation(*topics: str) -> GraphObservation:
    state = SystemState({name: ["/a"] for name in topics}, {name: ["/b"] for name in topics}, {})
    connections = {TopicConnection("/a", name, "/b"): None for name in topics}
    return GraphObservation(state, {}, {"/a": ObservedNode(), "/b": ObservedNode()}, connections)


def test_a_graph_is_laid_out_once_for_all_browsers() -> None:
    drawn: list[NodeGraph] = []

    async def draw(graph: NodeGraph, is_vertical: bool) -> Scene:
        drawn.append(graph)
        await asyncio.sleep(0)
        return Scene(width=float(len(graph.vertices)))

    async def look() -> None:
        drawings = GraphDrawings(draw)
        options = GraphOptions()
        first = drawings.graph(observation("/level"), options)
        scenes = await asyncio.gather(*(drawings.scene(first, options) for _ in range(3)))
        assert [scene.width for scene in scenes] == [3.0] * 3
        assert drawings.graph(observation("/level"), options) is first
        assert drawn == [first]
        second = drawings.graph(observation("/level", "/scan"), options)
        assert (await drawings.scene(second, options)).width == 4.0
        assert drawn == [first, second]
        assert (
            drawings.graph(observation("/level"), GraphOptions("nodes")).vertices.keys()
            < first.vertices.keys()
        )

    asyncio.run(look())


def test_a_graph_is_selected_again_only_after_a_change_of_its_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    select = Mock(wraps=node_graph)
    monkeypatch.setattr(graph_drawings, "node_graph", select)
    drawings, first = GraphDrawings(draw_nothing), observation("/level")
    with_rates = replace(first, connections=dict.fromkeys(first.connections, Traffic(10.0, 240.0)))
    for each in (first, observation("/level"), with_rates):
        drawings.graph(each, GraphOptions())
    assert select.call_count == 1
    changes = [
        replace(first, nodes={**first.nodes, "/b": ObservedNode(error="refused")}),
        replace(first, connections={}),
        replace(first, state=observation("/level", "/scan").state),
        replace(first, wrong_types={TopicConnection("/a", "/level", "/c"): WrongTypes("a/A", "b/B")}),
    ]
    for number, each in enumerate(changes, 2):
        drawings.graph(each, GraphOptions())
        assert select.call_count == number
    drawings.graph(replace(changes[-1]), GraphOptions(), removed={("node", "/b"): 1.0})
    assert select.call_count == 2 + len(changes)


async def draw_nothing(graph: NodeGraph, is_vertical: bool) -> Scene:
    return Scene()


def test_a_failed_drawing_is_tried_again() -> None:
    answers: list[Exception | Scene] = [RuntimeError("no thread"), Scene(width=1.0)]

    async def draw(graph: NodeGraph, is_vertical: bool) -> Scene:
        answer = answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    async def look() -> None:
        drawings = GraphDrawings(draw)
        graph = drawings.graph(observation("/level"), GraphOptions())
        with pytest.raises(RuntimeError, match="no thread"):
            await drawings.scene(graph, GraphOptions())
        assert (await drawings.scene(graph, GraphOptions())).width == 1.0

    asyncio.run(look())


def graph() -> NodeGraph:
    state = SystemState({"/level": ["/a"]}, {"/level": ["/b"]}, {})
    return node_graph(state, [TopicConnection("/a", "/level", "/b")], ["/b"], GraphOptions())


def test_the_widest_traffic_leaves_the_head_of_its_arrow_visible() -> None:
    scene = draw_scene(graph(), with_traffic=True)
    (route,) = [route for arrow, route, _ in scene.arrows if arrow.start.kind == "node"]
    (middle,) = [
        each["middle"][0] for each in scene_values(scene)["arrows"] if each["start"]["kind"] == "node"
    ]
    half = len("1000.0 Hz · 999.9 kB/s") * 6.3 / 2  # 6.3 pixels a letter, as in graph/canvas.js
    assert route[0][0] <= middle - half
    assert middle + half <= route[-1][0] - 10


@pytest.mark.parametrize("is_vertical", [False, True])
def test_no_box_covers_a_label(is_vertical: bool) -> None:
    for seed in (13, 34, 68, 90, 97, 172):
        chosen = random.Random(seed)  # noqa: S311
        nodes = [f"/node{number}" for number in range(chosen.randint(2, 9))]
        topics = [f"/topic{'x' * chosen.randint(0, 12)}{number}" for number in range(chosen.randint(2, 12))]
        ends = [{name: chosen.sample(nodes, chosen.randint(1, 2)) for name in topics} for _ in range(2)]
        state = SystemState(ends[0], ends[1], {})
        drawn = draw_scene(
            node_graph(state, [], [], GraphOptions("all")), with_traffic=True, is_vertical=is_vertical
        )
        for (arrow, _, text), value in zip(drawn.arrows, scene_values(drawn)["arrows"], strict=True):
            if letters := label_letters(arrow, text, is_vertical=drawn.is_vertical):
                label = Box(*value["middle"], letters * LETTER, LABEL_HEIGHT)
                assert [vertex.name for vertex, box, _ in drawn.boxes if overlap(label, box)] == [], seed


def test_the_middle_of_an_arrow_lies_before_its_end() -> None:
    upright = draw_scene(graph(), with_traffic=True, is_vertical=True)
    places = {vertex.key: box for vertex, box, _ in upright.boxes}
    arrows = scene_values(upright)["arrows"]
    assert arrows
    assert all(each["middle"][1] < places[Key(**each["end"])].y for each in arrows)
