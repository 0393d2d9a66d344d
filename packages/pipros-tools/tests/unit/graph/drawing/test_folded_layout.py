"""Long chains are broken into rows, in which nothing overlaps and no arrow loses its ends."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from pipros_tools.graph.drawing.folded_layout import folded, scale_on
from pipros_tools.graph.drawing.layered_layout import layered_layout
from pipros_tools.graph.drawing.node_graph import Arrow, Key, NodeGraph, Vertex
from pipros_tools.graph.drawing.scene import SCREEN, draw
from pipros_tools.graph.wrong_types import WrongTypes

names = st.integers(0, 25)


@pytest.mark.parametrize("count", [10, 20, 40])
def test_a_chain_of_any_length_keeps_its_size_on_the_screen(count: int) -> None:
    keys = range(count)
    arrows = list(itertools.pairwise(keys))
    wide = layered_layout(dict.fromkeys(keys, (120.0, 40.0)), arrows, rooms=[190.0] * len(arrows))
    assert scale_on(SCREEN, wide) < 0.5
    assert scale_on(SCREEN, folded(wide, SCREEN)) > 0.9


@given(st.lists(st.tuples(names, names), min_size=1, max_size=60))
@example([(0, 17), (1, 2), (2, 9), (3, 1), (9, 0)])  # boxes of several widths above each other
def test_in_rows_nothing_overlaps_and_arrows_keep_their_ends(arrows: list[tuple[int, int]]) -> None:
    sizes = {key: (40.0 + 3 * key, 20.0 + key % 3 * 10) for key in range(26)}
    layout = folded(layered_layout(sizes, arrows, gap=150.0), (900.0, 500.0))
    for one, other in itertools.combinations(layout.boxes.values(), 2):
        apart = abs(one.x - other.x) * 2 + 1e-6 >= one.width + other.width
        assert apart or abs(one.y - other.y) * 2 + 1e-6 >= one.height + other.height
    for (start, end), route in zip(arrows, layout.routes, strict=True):
        for key, (x, y) in ((start, route[0]), (end, route[-1])):
            box = layout.boxes[key]
            assert abs(abs(x - box.x) - box.width / 2) < 1e-6
            assert abs(y - box.y) < 1e-6
    corners = [
        (box.x + side * box.width / 2, box.y + side * box.height / 2)
        for box in layout.boxes.values()
        for side in (-1, 1)
    ]
    assert all(-1e-6 <= x <= layout.width + 1e-6 and -1e-6 <= y <= layout.height + 1e-6 for x, y in corners)


def test_an_arrow_to_the_next_row_runs_between_both_rows() -> None:
    keys = range(12)
    arrows = list(itertools.pairwise(keys))
    layout = folded(layered_layout(dict.fromkeys(keys, (120.0, 40.0)), arrows, gap=190.0), SCREEN)
    turns = [
        (layout.boxes[start], layout.boxes[end], route)
        for (start, end), route in zip(arrows, layout.routes, strict=True)
        if layout.boxes[end].x < layout.boxes[start].x
    ]
    assert turns
    for above, below, route in turns:
        assert above.y + above.height / 2 < route[2][1] == route[3][1] < below.y - below.height / 2


def test_a_wrong_type_only_lengthens_the_arrow_that_names_it() -> None:
    def gaps(wrong: WrongTypes | None) -> list[float]:
        parts = [
            Key("node", "/a"), Key("topic", "/b"), Key("node", "/c"), Key("topic", "/d"), Key("node", "/e"),
        ]  # fmt: skip
        arrows = [Arrow(start, end, "/b") for start, end in itertools.pairwise(parts)]
        arrows[1] = Arrow(parts[1], parts[2], "/b", wrong)
        scene = draw(NodeGraph({key: Vertex(key) for key in parts}, tuple(arrows)), with_traffic=True)
        return [round(route[-1][0] - route[0][0], 3) for _, route, _ in scene.arrows]

    right, wrong = gaps(None), gaps(WrongTypes("some_robot_msgs/ALongNameOfAType", "std_msgs/String"))
    assert (wrong[0], wrong[2:]) == (right[0], right[2:])
    assert right[1] < wrong[1] < 450


def test_a_label_names_both_ends_of_a_long_type() -> None:
    keys = Key("node", "/a"), Key("node", "/b")
    wrong = WrongTypes("some_robot_msgs/ALongNameOfAType", "std_msgs/String")
    scene = draw(NodeGraph({key: Vertex(key) for key in keys}, (Arrow(*keys, "/t", wrong),)))
    assert scene.arrows[0][2] == "/t  sent some_robot_…NameOfAType, wanted std_msgs/String"
