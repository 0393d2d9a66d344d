"""Cases computed by hand, mistakes in chains, and strange scans for all filters.

tests.golden.navigation.test_laser_filters_as_genuine compares all filters with the genuine ones.
"""

import math
from typing import Any

import numpy as np
import pytest

from pipros_robot.perception.laser.filters.base import FilterFailed, FilterHost, InvalidFilter
from pipros_robot.perception.laser.filters.chain import TYPES, chain_of
from pipros_robot.perception.laser.filters.shapes import in_polygon
from pipros_robot.perception.laser.scan import Scan

NAN = math.nan
MEDIAN = {
    "name": "m", "type": "filters/MultiChannelMedianFilterFloat", "params": {"number_of_observations": 3}
}  # fmt: skip
PARAMS: dict[str, dict[str, Any]] = {
    "LaserArrayFilter": {"range_filter_chain": [MEDIAN], "intensity_filter_chain": [MEDIAN]},
    "LaserMedianFilter": {"internal_filter": [MEDIAN]},
    "LaserScanAngularBoundsFilter": {"lower_angle": -0.5, "upper_angle": 0.5},
    "LaserScanAngularBoundsFilterInPlace": {"lower_angle": -0.5, "upper_angle": 0.5},
    "LaserScanFootprintFilter": {"inscribed_radius": 0.5},
    "LaserScanMaskFilter": {"masks": {"laser": [-5, 0, 1, 10**9]}},
    "LaserScanPolygonFilter": {"polygon": [[0, 0], [1, 0], [0, 1]], "polygon_frame": "base"},
    "StaticLaserScanPolygonFilter": {"polygon": [], "polygon_frame": "base"},
    "ScanBlobFilter": {"max_radius": 0.5, "min_points": 1},
    "ScanShadowsFilter": {"min_angle": 10, "max_angle": 170, "neighbors": 3, "window": 2},
}


def scan(*ranges: float, step: float = 0.1, intensities: tuple[float, ...] = ()) -> Scan:
    """Return a scan whose first beam has the angle 0."""
    arrays = np.array(ranges, np.float32), np.array(intensities, np.float32)
    end = step * (len(ranges) - 1)
    return Scan("laser", 10**9, 0.0, end, step, 0.001, 0.1, 0.1, 10.0, *arrays)


def filtered(kind: str, params: dict[str, Any], *scans: Scan) -> list[float]:
    """Return the ranges of the last scan after a filter."""
    chain = chain_of([{"name": "one", "type": f"laser_filters/{kind}", "params": params}], FilterHost())
    return [round(float(each), 4) for each in [chain.update(each) for each in scans][-1].ranges]


def same(one: list[float], other: list[float]) -> bool:
    return np.array_equal(one, other, equal_nan=True)


def test_ranges_at_or_beyond_the_thresholds_are_replaced() -> None:
    params = {"lower_threshold": 1, "upper_threshold": 3.0, "upper_replacement_value": NAN}
    assert same(filtered("LaserScanRangeFilter", params, scan(0.5, 1, 2, 3, NAN)), [0, 0, 2, NAN, NAN])


def test_a_scan_is_cut_to_the_bounds() -> None:
    chain = chain_of(
        [{"name": "a", "type": "laser_filters/LaserScanAngularBoundsFilter",
          "params": {"lower_angle": 0.15, "upper_angle": 0.35}}], FilterHost(),
    )  # fmt: skip
    cut = chain.update(scan(1, 2, 3, 4, 5, intensities=(1, 2, 3, 4, 5)))
    assert (list(cut.ranges), list(cut.intensities), cut.stamp_ns) == ([3, 4], [3, 4], 10**9 + 2 * 10**6)
    assert (cut.angle_min, cut.angle_max) == pytest.approx((0.2, 0.3))


def test_gaps_are_filled_with_the_mean_of_both_sides() -> None:
    assert filtered("InterpolationFilter", {}, scan(0, 2, 10, 11, 4, 0)) == [5.995, 2, 3, 3, 4, 4]


def test_points_behind_an_edge_are_shadows() -> None:
    """From the near point at 1 m to its neighbour at 3 m, the line is nearly along the beam."""
    params = {"min_angle": 10, "max_angle": 170, "neighbors": 1, "window": 1}
    assert same(filtered("ScanShadowsFilter", params, scan(3, 3, 1, 1, step=0.05)), [3, NAN, 1, 1])


def test_single_points_are_speckles() -> None:
    params = {"max_range": 5.0, "max_range_difference": 0.2, "filter_window": 2}
    found = filtered("LaserScanSpeckleFilter", params, scan(1, 1.1, 4, 2, 2.1, 9))
    assert same(found, [1, 1.1, NAN, 2, 2.1, 9])


def test_the_middle_of_a_small_blob_stays() -> None:
    params = {"max_radius": 0.2, "min_points": 2}
    assert filtered("ScanBlobFilter", params, scan(1, 1, 1.1, -1, 5, 1, 2)) == [-1, 1, -1.1, -1, -5, -1, -2]


def test_the_median_of_the_last_scans() -> None:
    params = PARAMS["LaserMedianFilter"]
    assert filtered("LaserMedianFilter", params, scan(1, 5), scan(3, 1), scan(2, 2), scan(0, 0)) == [2, 1]
    assert filtered("LaserMedianFilter", params, scan(1, 5), scan(3, 1), scan(7)) == [7]


def test_points_in_a_polygon() -> None:
    corners = np.array([[0, 0], [2, 0], [2, 2], [1, 1], [0, 2]], np.float32)
    points = np.array([[1, 0.5], [1, 1.5], [0.2, 1.5], [3, 1]], np.float32)
    assert in_polygon(corners, points).tolist() == [True, False, True, False]


@pytest.mark.parametrize(("chain", "text"), [
    ("range", "must be a list of filters, got 'range'"),
    ([{"name": "a"}], r"\[0\] must be a map with name and type"),
    ([{"name": "a", "type": "my/Filter"}], "type must be laser_filters/ followed by .*, got my/Filter"),
    ([{"name": "a", "type": "laser_filters/InterpolationFilter"}] * 2, "must be unique, got a twice"),
    ([{"name": "a", "type": "laser_filters/ScanBlobFilter", "params": 3}], "params must be a map, got 3"),
    ([{"name": "a", "type": "laser_filters/ScanBlobFilter"}], "max_radius must be of type float"),
    ([{"name": "a", "type": "laser_filters/LaserScanMaskFilter"}], "masks must map frames to lists"),
    ([{"name": "a", "type": "laser_filters/LaserArrayFilter"}], "range_filter_chain or intensity_filter"),
    (
        [{"name": "a", "type": "laser_filters/LaserMedianFilter", "params": {"internal_filter": [3]}}],
        "type must be filters/ followed by .*, got 3",
    ),
    (
        [{"name": "a", "type": "laser_filters/LaserScanPolygonFilter",
          "params": {"polygon_frame": "b", "polygon": [[1, 2]]}}],
        r"polygon must be empty or a list of 3 to 10000 \[x, y\]",
    ),
])  # fmt: skip
def test_mistakes_in_chains_are_named(chain: Any, text: str) -> None:
    with pytest.raises(InvalidFilter, match=text):
        chain_of(chain, FilterHost())


def test_an_old_chain_and_an_empty_one_are_accepted() -> None:
    assert chain_of(None, FilterHost()).filters == []
    old = {"filter_chain": [{"name": "a", "type": "laser_filters/InterpolationFilter"}]}
    assert len(chain_of(old, FilterHost()).filters) == 1


def strange_scan(numbers: Any) -> Scan:
    """Return a scan with any number of beams, any values, and any number of intensities."""
    values = np.array([0, -0.0, 1, -1, 2, 0.15, 9.99, 1e30, -1e30, 3e38, NAN, math.inf, -math.inf])
    count = int(numbers.choice([0, 1, 2, 3, 5, 20, 100]))
    made = scan(
        *numbers.choice(values, count), intensities=tuple(numbers.choice(values, numbers.integers(9)))
    )
    changes = {
        name: float(numbers.choice(values))
        for name in ("angle_min", "angle_increment", "time_increment", "range_min", "range_max")
        if numbers.random() < 0.2
    }
    return Scan(**{**{name: getattr(made, name) for name in made.__slots__}, **changes})


@pytest.mark.parametrize("kind", sorted(TYPES))
def test_strange_scans_are_filtered_or_dropped(kind: str) -> None:
    numbers = np.random.default_rng(1)
    description = [{"name": "one", "type": f"laser_filters/{kind}", "params": PARAMS.get(kind, {})}]
    chain, accepted = chain_of(description, FilterHost()), 0
    for _ in range(200):
        given = strange_scan(numbers)
        try:
            result = chain.update(given)
        except FilterFailed:
            continue
        accepted += 1
        assert len(result.ranges) <= len(given.ranges)
        assert len(result.intensities) <= len(given.intensities)
    needs_transforms = {"Box", "Footprint", "Polygon"}
    assert accepted > 0 or any(each in kind for each in needs_transforms)
