"""Layouts: nothing overlaps, arrows point to the right, groups have their own rectangles."""

import itertools
from collections.abc import Callable, Mapping

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from pipros_tools.graph.drawing.folded_layout import folded, scale_on
from pipros_tools.graph.drawing.layered_layout import Box, GraphLayout, layered_layout
from pipros_tools.graph.drawing.node_graph import Arrow, Key, NodeGraph, Vertex
from pipros_tools.graph.drawing.scene import SCREEN, draw
from pipros_tools.graph.wrong_types import WrongTypes
from tests.support.steps import grows_linearly

names = st.integers(0, 25)
graphs = st.lists(st.tuples(names, names), max_size=60)


def laid_out(arrows: list[tuple[int, int]], groups: Mapping[int, str] | None = None) -> GraphLayout[int]:
    sizes = {key: (40.0 + 3 * key, 20.0 + key % 3 * 10) for key in range(26)}
    return layered_layout(sizes, arrows, groups)


def overlap(one: Box, other: Box) -> bool:
    return (
        abs(one.x - other.x) * 2 + 1e-6 < one.width + other.width
        and abs(one.y - other.y) * 2 + 1e-6 < one.height + other.height
    )


@given(graphs)
def test_no_boxes_overlap_and_all_is_inside(arrows: list[tuple[int, int]]) -> None:
    layout = laid_out(arrows)
    for one, other in itertools.combinations(layout.boxes.values(), 2):
        assert not overlap(one, other)
    for box in layout.boxes.values():
        assert box.width / 2 <= box.x + 1e-6 <= layout.width - box.width / 2 + 2e-6
        assert box.height / 2 <= box.y + 1e-6 <= layout.height - box.height / 2 + 2e-6


@given(st.lists(st.tuples(names, names).filter(lambda pair: pair[0] < pair[1]), max_size=40))
def test_without_cycles_all_arrows_lead_to_the_right(arrows: list[tuple[int, int]]) -> None:
    layout = laid_out(arrows)
    for (start, end), route in zip(arrows, layout.routes, strict=True):
        assert layout.boxes[start].x < layout.boxes[end].x
        assert [x for x, _ in route] == sorted(x for x, _ in route)


@given(graphs)
def test_an_arrow_begins_at_its_start_and_ends_at_its_end(arrows: list[tuple[int, int]]) -> None:
    layout = laid_out(arrows)
    for (start, end), route in zip(arrows, layout.routes, strict=True):
        for key, (x, y) in ((start, route[0]), (end, route[-1])):
            assert abs(abs(x - layout.boxes[key].x) - layout.boxes[key].width / 2) < 1e-6
            assert abs(y - layout.boxes[key].y) < 1e-6


@given(graphs, st.dictionaries(names, st.sampled_from(["/a", "/b", ""])))
def test_groups_do_not_overlap(arrows: list[tuple[int, int]], groups: dict[int, str]) -> None:
    layout = laid_out(arrows, groups)
    assert set(layout.bands) == set(groups.values()) - {""}
    for one, other in itertools.combinations(layout.bands.values(), 2):
        assert not overlap(one, other)
    for (key, box), (name, band) in itertools.product(layout.boxes.items(), layout.bands.items()):
        assert overlap(box, band) == (groups.get(key) == name)


@given(graphs)
def test_the_same_graph_has_the_same_layout(arrows: list[tuple[int, int]]) -> None:
    assert laid_out(arrows) == laid_out(arrows)


def test_a_chain_is_drawn_as_a_straight_line() -> None:
    layout = layered_layout({"a": (10, 10), "b": (30, 20), "c": (10, 10)}, [("a", "b"), ("b", "c")])
    assert len({box.y for box in layout.boxes.values()}) == 1


def test_a_large_graph_of_many_cycles_stays_compact() -> None:
    sizes = dict.fromkeys(range(400), (100.0, 30.0))
    arrows = [(key, key * 7 % 400) for key in range(400)] + [(key, (key + 1) % 400) for key in range(400)]
    assert len({box.x for box in layered_layout(sizes, arrows).boxes.values()}) < 100


def test_an_empty_graph_has_no_size() -> None:
    assert layered_layout({}, []) == GraphLayout()


def test_the_cost_of_a_layout_is_linear_in_its_groups() -> None:
    def layout(count: int) -> Callable[[], object]:
        keys = [str(number) for number in range(count)]
        groups = {key: f"/group{number // 2}" for number, key in enumerate(keys)}
        arrows = [(keys[number], keys[number + 1]) for number in range(0, count - 1, 4)]
        return lambda: layered_layout(dict.fromkeys(keys, (50.0, 20.0)), arrows, groups)

    assert grows_linearly(layout)


def test_vertices_without_arrows_form_layers_after_the_others_if_the_height_is_limited() -> None:
    layout = layered_layout(dict.fromkeys("abcdefg", (40.0, 100.0)), [("a", "b")], tallest=230.0)
    assert layout.height <= 230
    assert layout.boxes["a"].x < layout.boxes["b"].x < min(layout.boxes[name].x for name in "cdefg")


# Long chains are broken into rows, in which nothing overlaps and no arrow loses its ends.


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
