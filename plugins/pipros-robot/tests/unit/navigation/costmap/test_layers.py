"""The layers of a costmap, compared with plain loops and with the distances of scipy."""

import logging
import math
import re
import sys
from dataclasses import replace
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from pipros.basics.errors import NotFound
from pipros.msg import load_message_class
from pipros_libraries.nodes.params import PrivateParameters
from pipros_libraries.transforms.pose import IDENTITY
from pipros_robot.navigation.costmap import layers
from pipros_robot.navigation.costmap.footprint import circle
from pipros_robot.navigation.costmap.grid import LETHAL, UNKNOWN
from pipros_robot.navigation.costmap.inflation_layer import InflationLayer
from pipros_robot.navigation.costmap.layered import Bounds, CellRectangle, LayeredCostmap, Pose2D
from pipros_robot.navigation.costmap.layers import LAYERS, SETTINGS
from pipros_robot.navigation.costmap.observations import ObservationSource, SourceSettings
from pipros_robot.navigation.costmap.obstacle_layer import ObstacleLayer
from pipros_robot.navigation.costmap.static_layer import StaticLayer, StaticSettings
from pipros_robot.navigation.costmap.voxel_layer import VoxelLayer
from tests.support.environments import REPOSITORY

ROBOT = Pose2D(0.0, 0.0, 0.0)
OccupancyGrid: Any = load_message_class("nav_msgs/OccupancyGrid")
OccupancyGridUpdate: Any = load_message_class("map_msgs/OccupancyGridUpdate")


def map_message(cells: Any, resolution: float = 0.1, x: float = 0.0, y: float = 0.0) -> Any:
    message = OccupancyGrid()
    message.header.frame_id = "map"
    message.info.height, message.info.width = np.shape(cells)
    message.info.resolution = resolution
    message.info.origin.position.x, message.info.origin.position.y = x, y
    message.data = np.ravel(cells).tolist()
    return message


def static(cells: Any, **options: Any) -> tuple[LayeredCostmap, StaticLayer]:
    costmap = LayeredCostmap(tracks_unknown=True)
    layer = StaticLayer("static", costmap, StaticSettings(**options))
    costmap.layers.append(layer)
    layer.set_map(map_message(cells))
    costmap.update(ROBOT)
    return costmap, layer


@pytest.mark.parametrize(("options", "costs"), [
    ({}, [255, 0, 0, 0, 254]), ({"track_unknown_space": False}, [0, 0, 0, 0, 254]),
    ({"trinary_costmap": False}, [255, 0, 127, 251, 254]),
    ({"trinary_costmap": False, "lethal_cost_threshold": 50}, [255, 0, 254, 254, 254]),
    ({"unknown_cost_value": 50}, [254, 0, 255, 0, 254]),
    ({"lethal_cost_threshold": -3}, [255, 254, 254, 254, 254]),
])  # fmt: skip
def test_cells_of_a_map_become_costs(options: dict[str, Any], costs: list[int]) -> None:
    costmap, _ = static([[-1, 0, 50, 99, 100]], **options)
    assert costmap.grid.costs.tolist() == [costs]


def test_the_whole_map_is_computed_again_after_a_reset() -> None:
    costmap, layer = static([[100, 0, 0, 0, 100]])
    costmap.grid.costs[...] = costmap.grid.default
    layer.reset()
    costmap.update(ROBOT)
    assert costmap.grid.costs.tolist() == [[254, 0, 0, 0, 254]]


def test_a_part_of_a_map_is_replaced() -> None:
    costmap, layer = static(np.zeros((6, 5)))
    layer.set_part(OccupancyGridUpdate(x=3, y=4, width=2, height=2, data=[100, 0, -1, 100]))
    costmap.update(ROBOT)

    assert (costmap.grid.costs[4:, 3:].tolist(), costmap.window) == ([[254, 0], [255, 254]], (3, 4, 5, 6))
    for x, y, width, height, count, error in (
        (4, 0, 2, 1, 2, "must lie inside the map of 5 X 6, got columns 4 to 6 and rows 0 to 1"),
        (-1, 0, 1, 1, 1, "must lie inside the map of 5 X 6"),
        (0, 0, 1, 2**32 - 1, 0, "must lie inside the map of 5 X 6"),
        (0, 0, 2, 2, 3, "must have 2 X 2 values, got 3"),
    ):
        with pytest.raises(ValueError, match=error):
            layer.set_part(OccupancyGridUpdate(x=x, y=y, width=width, height=height, data=[0] * count))


@pytest.mark.parametrize(
    ("width", "resolution", "x"), [(3, 0.1, 0.0), (4, 0.0, 0.0), (4, math.nan, 0.0), (4, 0.1, math.inf)]
)
def test_an_invalid_map_is_refused(width: int, resolution: float, x: float) -> None:
    message = map_message([[0, 0, 0, 0]], resolution, x)
    message.info.width = width
    with pytest.raises(ValueError, match="a map"):
        StaticLayer("static", LayeredCostmap(), StaticSettings()).set_map(message)


def test_a_rolling_costmap_looks_into_a_turned_map() -> None:
    costmap = LayeredCostmap(is_rolling=True)
    costmap.resize(10, 10, 0.1, 0.0, 0.0)
    turned = (0.0, 0.0, 0.0, 0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))
    layer = StaticLayer("static", costmap, StaticSettings(), lambda _: turned)
    costmap.layers.append(layer)
    cells = np.zeros((20, 20))
    cells[12, 3] = 100  # at x 0.3 to 0.4, y 1.2 to 1.3 of a map whose lower left corner is at (-1, -1)
    layer.set_map(map_message(cells, x=-1.0, y=-1.0))
    costmap.update(Pose2D(0.2, 0.6, 0.0))

    found = [costmap.grid.cell_to_world(x, y) for y, x in np.argwhere(costmap.grid.costs == LETHAL)]
    # A point (x, y) of the costmap is (-y, x) in the map, where the obstacle's centre is (-0.65, 0.25).
    assert found == [pytest.approx((0.25, 0.65))]


class Filled:
    """A layer that sets all cells to a cost."""

    name, is_enabled, is_current = "filled", True, True

    def __init__(self, costmap: LayeredCostmap, cost: int) -> None:
        self._costmap, self._cost = costmap, cost

    def update_bounds(self, robot: Pose2D, bounds: Bounds) -> None:
        bounds.touch(robot.x - 99.0, robot.y - 99.0)
        bounds.touch(robot.x + 99.0, robot.y + 99.0)

    def update_costs(self, window: CellRectangle) -> None:
        self._costmap.grid.costs[window.slices] = self._cost

    def footprint_changed(self) -> None: ...

    def match_size(self) -> None: ...

    def reset(self) -> None: ...


def test_a_map_is_combined_by_maximum_and_kept_by_a_reset() -> None:
    for is_rolling in (False, True):
        costmap = LayeredCostmap(is_rolling=is_rolling)
        costmap.resize(3, 1, 0.1, -0.1, -0.05)
        layer = StaticLayer("static", costmap, StaticSettings(use_maximum=True), lambda _: IDENTITY)
        costmap.layers += [Filled(costmap, 100), layer]
        costmap.update(ROBOT)
        assert costmap.grid.costs.tolist() == [[100, 100, 100]]  # without a map
        layer.set_map(map_message([[100, 0, -1]], x=-0.1, y=-0.05))
        layer.reset()
        costmap.update(ROBOT)
        assert costmap.grid.costs.tolist() == [[254, 100, 255 if is_rolling else 100]]


def test_a_map_without_a_transform_or_without_cells_changes_nothing() -> None:
    costmap = LayeredCostmap(is_rolling=True)
    costmap.resize(3, 1, 0.1, -0.1, -0.05)
    unknown = StaticLayer("static", costmap, StaticSettings())
    empty = StaticLayer("empty", costmap, StaticSettings(), lambda _: IDENTITY)
    costmap.layers += [Filled(costmap, 100), unknown, empty]
    unknown.set_map(map_message([[100, 100, 100]]))
    empty.set_map(map_message(np.zeros((0, 0))))
    costmap.update(ROBOT)
    assert costmap.grid.costs.tolist() == [[100, 100, 100]]


def obstacles(
    *sources: SourceSettings, clears_footprint: bool = False
) -> tuple[LayeredCostmap, ObstacleLayer]:
    costmap = LayeredCostmap()
    costmap.resize(60, 60, 0.1, -3.0, -3.0)
    layer = ObstacleLayer("obstacles", costmap, lambda: 0, tracks_unknown=False)
    layer.clears_footprint = clears_footprint
    layer.sources += map(ObservationSource, sources)
    costmap.layers.append(layer)
    return costmap, layer


def see(layer: ObstacleLayer, points: Any, source: int = 0, now_ns: int = 1, stamp_ns: int = 1) -> None:
    rows = np.array(points, np.float32).reshape(-1, 3)
    layer.sources[source].add(rows, IDENTITY, IDENTITY, stamp_ns, now_ns, 1000)


SCANNER = SourceSettings("scan", "LaserScan", clearing=True)


def test_what_a_sensor_sees_is_marked_and_what_it_sees_through_is_cleared() -> None:
    costmap, layer = obstacles(SCANNER)
    see(layer, [(1.05, 0.05, 0.3), (0.05, 2.05, 2.1), (0.05, -2.62, 0.0)])
    costmap.update(ROBOT)
    marked = np.argwhere(costmap.grid.costs == LETHAL).tolist()
    assert marked == [[30, 40]]  # 2.1 m is too high, 2.62 m too far

    see(layer, [(2.05, 0.05, 0.0)])
    costmap.update(ROBOT)
    assert np.argwhere(costmap.grid.costs == LETHAL).tolist() == [[30, 50]]


def test_rays_are_cut_at_the_edge_of_the_map_and_at_their_range() -> None:
    costmap, layer = obstacles(SCANNER)
    layer.grid.costs[...] = LETHAL
    see(layer, [(9.0, 0.05, 0.0), (0.05, 9.0, 0.0), (-9.0, -9.0, 0.0)])
    costmap.update(ROBOT)

    freed = np.argwhere(layer.grid.costs == 0)
    straight = {(30, x) for x in range(30, 60)} | {(y, 30) for y in range(30, 60)}
    assert straight <= {tuple(cell) for cell in freed}
    assert min(30 - y for y, _ in freed if y < 30) >= 1
    assert len(freed) == 30 + 29 + 21  # 3 m are 21 cells on the diagonal


def test_a_sensor_outside_the_map_does_not_clear() -> None:
    warnings: list[str] = []
    costmap, layer = obstacles(SCANNER)
    layer._warn = lambda text, *values: warnings.append(text % values)
    far = (9.0, 0.0, 0.0, *IDENTITY[3:])
    layer.sources[0].add(np.zeros((1, 3), np.float32), far, far, 1, 1, 10)
    costmap.update(ROBOT)
    assert "the sensor at (9.00, 0.00) is outside the costmap" in warnings[0]


def test_points_that_are_not_finite_are_ignored() -> None:
    costmap, layer = obstacles(SCANNER)
    see(layer, [(math.nan, 0.0, 0.0), (math.inf, 0.0, 0.0), (1.0, -math.inf, 0.0), (1.05, 0.05, math.nan)])
    costmap.update(ROBOT)
    assert not np.any(costmap.grid.costs)


def test_observations_are_kept_for_their_time_and_within_the_limit() -> None:
    source = ObservationSource(SourceSettings("cloud", observation_persistence=2.0, expected_update_rate=1.0))
    for at in range(5):
        source.add(np.zeros((10, 3), np.float32), IDENTITY, IDENTITY, at * 10**9, at * 10**9, 25)
    assert [each.stamp_ns for each in source.observations()] == [4 * 10**9, 3 * 10**9]
    assert source.is_current(5 * 10**9)
    assert not source.is_current(5 * 10**9 + 1)

    only_last = ObservationSource(SourceSettings("cloud"))
    for at in range(3):
        only_last.add(np.zeros((1, 3), np.float32), IDENTITY, IDENTITY, at, at, 100)
    assert [each.stamp_ns for each in only_last.observations()] == [2]


@pytest.mark.parametrize(("combination", "expected"), [(0, 0), (1, 200), (99, 200)])
def test_costs_are_combined_with_those_of_earlier_layers(combination: int, expected: int) -> None:
    costmap, layer = obstacles(SCANNER, clears_footprint=True)
    costmap.set_footprint(circle(0.5))
    costmap.layers.insert(0, Filled(costmap, 200))
    layer.combination = combination
    layer.grid.costs[29:32, 29:32] = LETHAL
    see(layer, [(1.05, 0.05, 0.0)])
    costmap.update(ROBOT)

    assert costmap.grid.costs[30, 30] == expected
    assert costmap.grid.costs[30, 40] == (LETHAL if combination in (0, 1) else 200)


def test_a_cleared_area_is_computed_again() -> None:
    costmap, layer = obstacles(SCANNER)
    see(layer, [(1.05, 0.05, 0.0), (-1.05, 0.05, 0.0)])
    costmap.update(ROBOT)
    layer.sources[0].clear()
    layer.clear_area(0, 0, 30, 60)
    costmap.update(ROBOT)
    assert np.argwhere(costmap.grid.costs == LETHAL).tolist() == [[30, 19]]
    layer.clear_area(0, 0, 30, 60, inside=True)
    costmap.update(ROBOT)
    assert not np.any(costmap.grid.costs == LETHAL)
    layer.reset()
    assert not np.any(layer.grid.costs)


def test_an_inflation_of_radius_0_does_nothing_and_reset_keeps_it() -> None:
    costmap, _ = static(np.array([[100, 0, 0]]))
    inflation = InflationLayer("inflation", costmap)
    costmap.layers.append(inflation)
    costmap.set_footprint(circle(0.11))
    for radius, expected in ((0.0, [254, 0, 0]), (0.1, [254, 253, 0])):
        inflation.configure(radius=radius, scaling=1.0, inflate_unknown=False)
        inflation.reset()
        costmap.update(ROBOT)
        assert costmap.grid.costs.tolist() == [expected]


def inflated_row(cells: int, resolution: float, inscribed: float = math.inf, **settings: float) -> Any:
    """Return the costs of a row of cells beside an obstacle in the first one."""
    costmap = LayeredCostmap()
    costmap.resize(cells, 1, resolution, 0.0, 0.0)
    costmap.inscribed_radius = inscribed
    inflation = InflationLayer("inflation", costmap)
    inflation.configure(**settings, inflate_unknown=False)
    costmap.grid.costs[0, 0] = LETHAL
    inflation.update_costs(CellRectangle(0, 0, cells, 1))
    return costmap.grid.costs[0]


def test_inflation_of_a_long_map_with_tiny_cells_takes_little_memory() -> None:
    assert np.count_nonzero(inflated_row(40_001, 1e-30, radius=0.5, scaling=3.0) == 253) == 40_000


def inflated(cells: Any, inflate_unknown: bool = False) -> tuple[LayeredCostmap, StaticLayer]:
    costmap, layer = static(cells)
    costmap.set_footprint(circle(0.25))
    inflation = InflationLayer("inflation", costmap)
    costmap.layers.append(inflation)
    inflation.configure(radius=0.75, scaling=4.0, inflate_unknown=inflate_unknown)
    costmap.update(ROBOT)
    return costmap, layer


def expected_costs(cells: Any, inscribed: float, inflate_unknown: bool) -> Any:
    """Return costs from the distances of scipy, cell by cell."""
    distances = distance_transform_edt(cells != 100) * np.float32(0.1)
    costs = np.where(cells == 100, 254, np.where(cells == -1, 255, 0))
    for (y, x), distance in np.ndenumerate(distances):
        if 0 < distance <= 0.8 + 1e-6:
            cost = 253 if distance <= inscribed else int(252 * math.exp(-4.0 * (distance - inscribed)))
            if costs[y, x] == 255:
                if cost >= 253 or (inflate_unknown and cost > 0):
                    costs[y, x] = cost
            else:
                costs[y, x] = max(costs[y, x], cost)
    return costs


@pytest.mark.parametrize("inflate_unknown", [False, True])
def test_costs_decrease_with_the_distance_from_obstacles(inflate_unknown: bool) -> None:
    numbers = np.random.default_rng(5)
    cells = np.where(numbers.random((50, 70)) < 0.01, 100, 0)
    cells[20:30, 10:40] = -1
    cells[25, 20] = 100
    costmap, _ = inflated(cells, inflate_unknown)

    expected = expected_costs(cells, costmap.inscribed_radius, inflate_unknown)
    # a rounding error may cross an integer
    assert np.abs(costmap.grid.costs.astype(int) - expected).max() <= 1
    assert np.count_nonzero(costmap.grid.costs != expected) <= 5


def test_an_update_of_a_part_gives_the_same_as_one_of_all() -> None:
    numbers = np.random.default_rng(6)
    cells = np.where(numbers.random((60, 60)) < 0.01, 100, 0)
    costmap, layer = inflated(cells)
    for _ in range(10):
        x, y = (int(number) for number in numbers.integers(0, 55, 2))
        part = np.where(numbers.random((5, 5)) < 0.1, 100, 0)
        cells[y : y + 5, x : x + 5] = part
        layer.set_part(OccupancyGridUpdate(x=x, y=y, width=5, height=5, data=part.ravel().tolist()))
        costmap.update(ROBOT)
        assert costmap.window is not None
        assert costmap.window[2] - costmap.window[0] < 60
    costmap.update(ROBOT)
    assert np.array_equal(costmap.grid.costs, inflated(cells)[0].grid.costs)


def test_the_costs_of_the_documentation() -> None:
    costs = inflated_row(31, 0.05, 0.325, radius=0.55, scaling=10.0)
    assert costs[[6, 7, 10, 11, 12]].tolist() == [253, 196, 43, 26, 0]


def test_voxels_are_cleared_at_the_height_of_the_ray_only() -> None:
    warnings: list[str] = []
    costmap = LayeredCostmap()
    costmap.resize(60, 60, 0.1, -3.0, -3.0)
    layer = VoxelLayer(
        "voxels", costmap, lambda: 0, tracks_unknown=True, warn=lambda *text: warnings.append(text[0])
    )
    layer.configure(
        {"origin_z": 0.0, "z_resolution": 0.5, "z_voxels": 4, "mark_threshold": 0, "unknown_threshold": 2}
    )
    layer.clears_footprint = False
    clouds = replace(SCANNER, data_type="PointCloud2", min_obstacle_height=-1.0)
    layer.sources.append(ObservationSource(clouds))
    costmap.layers.append(layer)

    def cost(height: float, x: float = 2.05) -> int:
        """See a point behind the one at x = 1.05; return the layer's cost there."""
        see(layer, [(x, 0.05, height)])
        costmap.update(ROBOT)
        return int(layer.grid.costs[30, 40])

    assert cost(0.2) == UNKNOWN, "3 of 4 voxels are unknown"
    assert (cost(0.2, 1.05), layer.columns.costs[30, 40]) == (LETHAL, 0x1FFFF)
    assert cost(1.9) == LETHAL, "the ray passes above"
    assert cost(0.1) == 0, "the ray passes the marked voxel; another one is known by now"
    assert cost(9.0) == 0, "too high to be marked"
    layer.reset()
    assert (layer.columns.costs == 0xFFFF).all()
    low = (0.0, 0.0, -1.0, *IDENTITY[3:])
    layer.sources[0].add(np.ones((1, 3), np.float32), IDENTITY, low, 1, 1, 10)
    costmap.update(ROBOT)
    assert warnings == ["the sensor at (%.2f, %.2f, %.2f) is outside the voxels and cannot clear them"]


def test_each_type_of_layer_has_settings() -> None:
    assert LAYERS.keys() == SETTINGS.keys()


# A layer of an installed package: the example in docs/guides/navigation.md, loaded by its entry point.


KIND = "my_robot::KeepOut"


class Params:
    """A parameter server with the parameters of one layer."""

    def get(self, name: str) -> Any:
        if name == "~costmap/stairs":
            return {"area": [0.25, 0.25, 0.65, 0.45]}
        raise NotFound(name)


def costmap_with(entries: list[dict[str, str]]) -> Any:
    layered = LayeredCostmap()
    layered.resize(10, 10, 0.1, 0.0, 0.0)
    node = SimpleNamespace(params=Params())
    return SimpleNamespace(
        node=node, log=logging.getLogger("costmap"), namespace="~costmap", layered=layered,
        given=PrivateParameters({"plugins": entries}),
    )  # fmt: skip


@pytest.fixture
def point(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (REPOSITORY / "plugins/pipros-robot/docs/guides/navigation.md").read_text(encoding="utf-8")
    section = text.partition("## Your own costmap layer")[2]
    code = re.search(r"```python\n(.*?)```", section, re.DOTALL)
    declared = re.search(r'```toml\n.*entry-points."(.+)"]\n"(.+)" = "[\w.]+:(\w+)"\n```', section)
    assert code is not None
    assert declared is not None
    group, kind, name = declared.groups()
    (tmp_path / "keep_out_example.py").write_text(code[1], encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "keep_out_example", raising=False)
    bad = EntryPoint("bad::Layer", "no_such_module:Layer", layers.ENTRY_POINTS)
    points = EntryPoints([EntryPoint(kind, f"keep_out_example:{name}", group), bad])
    monkeypatch.setattr(layers, "entry_points", points.select)


@pytest.mark.usefixtures("point")
def test_the_documented_layer_marks_its_area() -> None:
    costmap = costmap_with([{"name": "stairs", "type": KIND}])
    assert layers.add_layers(costmap) == []
    costmap.layered.update(Pose2D(0.0, 0.0, 0.0))
    expected = np.zeros((10, 10), np.uint8)
    expected[2:5, 2:7] = 254
    assert np.array_equal(costmap.layered.grid.costs, expected)


@pytest.mark.usefixtures("point")
def test_a_layer_that_cannot_be_imported_is_left_out(caplog: pytest.LogCaptureFixture) -> None:
    costmap = costmap_with([{"name": "a", "type": "bad::Layer"}, {"name": "stairs", "type": KIND}])
    layers.add_layers(costmap)
    assert [each.name for each in costmap.layered.layers] == ["stairs"]
    assert "a: bad::Layer cannot be imported: ModuleNotFoundError" in caplog.text


def test_an_unknown_layer_with_sources_runs_as_a_voxel_or_obstacle_layer(monkeypatch, caplog) -> None:
    made = []

    def make(costmap: Any, name: str, kind: str) -> list[str]:
        made.append((name, kind))
        costmap.layered.layers.append(name)
        return [name]

    monkeypatch.setattr(layers, "LAYERS", dict.fromkeys(layers.LAYERS, make))
    values = {
        "~costmap/cliff": {"observation_sources": "scan"},
        "~costmap/depth": {"observation_sources": "scan", "z_voxels": 4},
    }
    costmap = costmap_with([{"name": name, "type": f"fetch::{name}"} for name in ("cliff", "depth")])
    costmap.node.params = SimpleNamespace(get=lambda name: values.get(name, {}))

    layers.add_layers(costmap)

    assert made == [("cliff", layers.OBSTACLE), ("depth", layers.VOXEL)]
    assert "fetch::cliff" in caplog.text
    assert costmap.blind_without == []


@pytest.mark.usefixtures("point")
@pytest.mark.parametrize(("others", "blind"), [([], ["a"]), ([{"name": "stairs", "type": KIND}], [])])
def test_a_costmap_without_any_sensor_names_the_layers_that_are_missing(
    others: list[dict[str, str]], blind: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def inflate(costmap: Any, name: str, _: str) -> list[Any]:
        costmap.layered.layers.append(SimpleNamespace(name=name))
        return []

    monkeypatch.setattr(layers, "LAYERS", {layers.INFLATION: inflate})
    inflation = {"name": "inflation", "type": layers.INFLATION}
    costmap = costmap_with([{"name": "a", "type": "bad::Layer"}, inflation, *others])

    layers.add_layers(costmap)

    assert costmap.blind_without == blind
