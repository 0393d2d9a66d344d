"""Layouts: nothing overlaps, arrows point to the right, groups have their own rectangles."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping

from hypothesis import given
from hypothesis import strategies as st

from pipros_tools.graph.drawing.layered_layout import Box, GraphLayout, layered_layout
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
