"""Paths over costs, compared with a plain loop and with the shortest paths of scipy."""

import heapq
import math
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from pipros_robot.navigation.navfn.plan import Descent, find_field, plan
from pipros_robot.navigation.navfn.potential import UNREACHED, crossing_costs

BLOCKED = 254


def building(seed: int, width: int = 90, height: int = 70, walls: int = 14) -> Any:
    """Return costs of a building with walls, inflated, and unknown parts."""
    numbers = np.random.default_rng(seed)
    occupied = np.zeros((height, width), bool)
    for _ in range(walls):
        x, y = int(numbers.integers(0, width)), int(numbers.integers(0, height))
        if numbers.random() < 0.5:
            occupied[y : y + 2, x : x + 25] = True
        else:
            occupied[y : y + 25, x : x + 2] = True
    occupied[3:9, 3:9] = occupied[-9:-3, -9:-3] = False
    distances = distance_transform_edt(~occupied)
    costs = np.where(distances <= 2, 253, 252 * np.exp(-0.4 * (distances - 2))).astype(np.uint8)
    costs[occupied] = 254
    costs[30:36, 40:60][costs[30:36, 40:60] < 50] = 255
    return costs


def wave(crossing: Any, start: tuple[int, int]) -> Any:
    """Return all potentials, with a queue by potential, one cell at a time."""
    height, width = crossing.shape
    field = np.full((height, width), math.inf)
    field[start[1], start[0]] = 0.0
    queue = [(0.0, start)]
    while queue:
        value, (x, y) = heapq.heappop(queue)
        if value > field[y, x]:
            continue
        for to_x, to_y in ((x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)):
            if not (0 < to_x < width - 1 and 0 < to_y < height - 1) or crossing[to_y, to_x] >= BLOCKED:
                continue
            cost = float(crossing[to_y, to_x])
            in_x = min(field[to_y, to_x - 1], field[to_y, to_x + 1])
            in_y = min(field[to_y - 1, to_x], field[to_y + 1, to_x])
            low, high = sorted((in_x, in_y))
            q = (high - low) / cost if high < math.inf else math.inf
            new = low + (cost if q >= 1 else cost * (-0.2301 * q * q + 0.5307 * q + 0.7040))
            if new < field[to_y, to_x]:
                field[to_y, to_x] = new
                heapq.heappush(queue, (new, (to_x, to_y)))
    return field


def cheapest(crossing: Any, start: tuple[int, int], goal: tuple[int, int]) -> float:
    """Return the cost of the cheapest path with the moves of a king and a knight, by scipy's Dijkstra."""
    height, width = crossing.shape
    at = np.arange(crossing.size).reshape(crossing.shape)
    rows, columns, weights = [], [], []
    moves = [(x, y) for x in range(-2, 3) for y in range(-2, 3) if math.gcd(x, y) == 1]
    for dx, dy in moves:
        here = (slice(max(0, -dy), height - max(0, dy)), slice(max(0, -dx), width - max(0, dx)))
        there = (slice(max(0, dy), height - max(0, -dy)), slice(max(0, dx), width - max(0, -dx)))
        is_open = (crossing[here] < BLOCKED) & (crossing[there] < BLOCKED)
        rows.append(at[here][is_open])
        columns.append(at[there][is_open])
        weights.append(((crossing[here] + crossing[there]) / 2 * math.hypot(dx, dy))[is_open])
    graph = coo_matrix(
        (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))),
        shape=(crossing.size, crossing.size),
    )
    found = dijkstra(graph.tocsr(), indices=start[1] * width + start[0])
    return float(found[goal[1] * width + goal[0]])


def path_cost(crossing: Any, path: list[tuple[float, float]]) -> float:
    """Return the cost along a path: of each step, its length times the cost of the cell in its middle."""
    points = np.array(path)
    middles = np.rint((points[1:] + points[:-1]) / 2).astype(int)
    lengths = np.hypot(*(points[1:] - points[:-1]).T)
    return float((crossing[middles[:, 1], middles[:, 0]] * lengths).sum())


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("use_astar", [False, True])
def test_potentials_and_paths_are_the_cheapest(seed: int, use_astar: bool) -> None:
    costs = building(seed)
    start, goal = (5, 5), (84, 64)
    crossing = crossing_costs(costs, allow_unknown=True)
    field = find_field(costs, start, goal, use_astar=use_astar)
    path = plan(costs, start, goal, use_astar=use_astar)

    expected = wave(crossing, start)[goal[1], goal[0]]
    if expected == math.inf:
        assert path == []
        return
    assert field.potential(goal) == pytest.approx(expected, rel=0.02 if use_astar else 0.005)
    assert (path[0], path[-1]) == (start, goal)
    assert np.hypot(*np.diff(np.array(path), axis=0).T).max() <= math.sqrt(2) + 1e-6
    cells = np.rint(path).astype(int)
    assert crossing[cells[:, 1], cells[:, 0]].max() < BLOCKED
    assert path_cost(crossing, path) <= 1.03 * cheapest(crossing, start, goal)


def test_some_buildings_have_paths_and_some_have_none() -> None:
    found = [bool(plan(building(seed), (5, 5), (84, 64))) for seed in range(6)]
    assert found.count(True) >= 3


def test_a_potential_is_never_below_the_straight_way() -> None:
    """`find_field` relies on this where it decides that a way outside of a region cannot be cheaper."""
    crossing = crossing_costs(np.zeros((200, 200), np.uint8), allow_unknown=True)
    field = wave(crossing, (100, 100))
    y, x = np.mgrid[1:199, 1:199]
    straight = np.hypot(x - 100, y - 100) * 50
    assert (field[1:199, 1:199] >= 0.95 * straight).all()


def test_a_region_is_searched_first_and_then_the_whole_map() -> None:
    costs = np.zeros((400, 500), np.uint8)
    near = find_field(costs, (100, 100), (150, 120))
    assert (near.window, near.path_to((150, 120), 2000)[0]) == ((40, 40, 211, 181), (100, 100))

    costs[:380, 125] = 254
    far = find_field(costs, (100, 100), (150, 120))
    assert far.window == (0, 0, 500, 400)
    path = far.path_to((150, 120), 2000)
    assert max(y for _, y in path) >= 379


def test_unknown_cells_are_crossed_only_if_allowed() -> None:
    costs = np.zeros((20, 20), np.uint8)
    costs[:, 10] = 255
    assert plan(costs, (3, 3), (15, 3))
    assert plan(costs, (3, 3), (15, 3), allow_unknown=False) == []


@pytest.mark.parametrize(
    ("start", "goal"), [((0, 0), (5, 5)), ((5, 5), (0, 0)), ((19, 19), (5, 5)), ((5, 5), (5, 5))]
)
def test_the_border_cannot_be_crossed(start: tuple[int, int], goal: tuple[int, int]) -> None:
    path = plan(np.zeros((20, 20), np.uint8), start, goal)
    assert path == ([(5.0, 5.0)] if start == goal else [])


def test_a_way_down_ends_where_it_cannot_go_on() -> None:
    field = np.full((9, 9), 1e10, np.float32)
    assert Descent(field).follow((4, 4), (1, 1), 100) == []  # no potential around
    field[1:8, 1:8] = 500.0
    assert Descent(field).follow((4, 4), (1, 1), 100) == []  # no slope
    field[:] = np.arange(9) * 100 + 1000.0
    assert Descent(field).follow((4, 4), (0, 4), 100) == []  # to the border, not to the start
    field[:, 1] = 10.0
    down = Descent(field).follow((6, 4), (1, 4), 100)
    assert down[-1] == (1.0, 4.0)
    assert Descent(field).follow((6, 4), (1, 4), len(down) - 1) == []  # too many points


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (2, 2), (3, 3)])
def test_tiny_maps_have_no_way(shape: tuple[int, int]) -> None:
    assert plan(np.zeros(shape, np.uint8), (0, 0), (shape[1] - 1, shape[0] - 1)) in ([], [(0.0, 0.0)])
    assert find_field(np.full(shape, 254, np.uint8), (0, 0), (0, 0)).potential((9, 9)) == UNREACHED
