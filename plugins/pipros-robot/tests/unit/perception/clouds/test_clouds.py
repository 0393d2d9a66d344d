"""Cases computed by hand, and strange clouds; tests.interop.test_clouds_as_genuine compares with PCL."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from pipros.msg import load_message_class
from pipros_robot.perception.clouds import filters
from pipros_robot.perception.clouds.filter_nodes import transformed
from pipros_robot.perception.clouds.pcd import MODES, InvalidPcd, formatted, parse
from pipros_robot.perception.clouds.points import (
    InvalidCloud,
    cloud_of,
    column,
    exact_matrix_of,
    positions,
    rows_of,
)
from pipros_robot.perception.clouds.segmentation import clusters, plane

Header: Any = load_message_class("std_msgs/Header")
LIMITS = {
    "filter_field_name": "z", "filter_limit_min": 0.0, "filter_limit_max": 1.0,
    "filter_limit_negative": False, "keep_organized": False,
}  # fmt: skip
ORGANIZED = {**LIMITS, "keep_organized": True}
BOX = {
    **{f"{end}_{axis}": sign for end, sign in (("min", -1.0), ("max", 1.0)) for axis in "xyz"},
    "keep_organized": False, "negative": False,
}  # fmt: skip
GRID = {**LIMITS, "leaf_size": 1.0, "min_points_per_voxel": 1, "filter_field_name": ""}
NAN = math.nan


def cloud(*points: tuple[float, float, float], **more: Any) -> Any:
    table = np.array(points, np.float32).reshape(-1, 3)
    return cloud_of(Header(frame_id="lidar"), {**dict(zip("xyz", table.T, strict=True)), **more})


def points_of(found: Any) -> list[tuple[float, ...]]:
    return [tuple(map(float, each)) for each in positions(found, rows_of(found))]


def test_limits_belong_to_both_sides() -> None:
    given = cloud((0, 0, -0.1), (0, 0, 0), (0, 0, 0.5), (0, 0, 1), (NAN, 0, 0.5))
    assert points_of(filters.pass_through(given, LIMITS)) == [(0, 0, 0), (0, 0, 0.5), (0, 0, 1)]
    outside = points_of(filters.pass_through(given, {**LIMITS, "filter_limit_negative": True}))
    assert [each[2] for each in outside] == pytest.approx([-0.1, 0, 1])


def test_an_organized_cloud_keeps_its_shape() -> None:
    given = cloud((0, 0, 0), (0, 0, 2))
    found = filters.pass_through(given, {**LIMITS, "keep_organized": True})
    assert (found.width, found.is_dense) == (2, False)
    assert np.isnan(positions(found, rows_of(found))[1]).all()
    assert column(given, rows_of(given), "z").tolist() == [0, 2]


def test_an_organized_cloud_keeps_points_whose_field_is_nan() -> None:
    given = cloud((NAN, np.inf, NAN), (NAN, np.inf, 2))
    found = filters.pass_through(given, ORGANIZED)
    assert column(found, rows_of(found), "y")[0] == np.inf
    assert np.isnan(column(found, rows_of(found), "y")[1])


def test_the_faces_of_a_box_are_inside() -> None:
    given = cloud((1, 1, 1), (1.01, 0, 0), (NAN, 0, 0))
    assert points_of(filters.crop_box(given, BOX))[0] == (1, 1, 1)
    assert points_of(filters.crop_box(given, {**BOX, "negative": True})) == [(pytest.approx(1.01), 0, 0)]


def test_only_chosen_points_are_compared_with_a_box() -> None:
    given = cloud((0, 0, 0), (5, 0, 0), (0.5, 0, 0), (9, 0, 0))
    assert points_of(filters.crop_box(given, BOX, [2, 1, 0])) == [(0.5, 0, 0), (0, 0, 0)]
    organized = filters.crop_box(given, {**BOX, "keep_organized": True}, [0, 1])
    assert [each[0] for each in points_of(organized)] == pytest.approx([0, NAN, 0.5, 9], nan_ok=True)
    with pytest.raises(InvalidCloud, match="indices must be >= 0 and < 4, got 0 to 4"):
        filters.crop_box(given, BOX, [0, 4])


def test_neighbors_of_chosen_points_are_those_of_the_whole_cloud() -> None:
    given = cloud((0, 0, 0), (0.1, 0, 0), (5, 0, 0), (9, 0, 0), (20, 0, 0))
    values = {"mean_k": 2, "stddev": 0.5, "negative": False}  # distances 0.1, 4 and 11
    assert points_of(filters.statistical_outlier_removal(given, values, [0, 3, 4])) == [(0, 0, 0), (9, 0, 0)]


def test_cells_become_the_mean_of_their_points_and_colors() -> None:
    colors = np.array([0x00102030, 0x00302010, 0x00FFFFFF], np.uint32)
    given = cloud((0.1, 0.1, 0.1), (0.3, 0.5, 0.1), (-0.5, 0, 0), rgb=colors.view(np.float32))
    found = filters.voxel_grid(given, GRID)
    assert (points_of(found)[0], points_of(found)[1]) == ((-0.5, 0, 0), pytest.approx((0.2, 0.3, 0.1)))
    assert column(found, rows_of(found), "rgb").copy().view(np.uint32).tolist() == [0x00FFFFFF, 0x00202020]
    assert len(points_of(filters.voxel_grid(given, {**GRID, "min_points_per_voxel": 2}))) == 1


def test_a_grid_may_have_more_cells_than_numbers() -> None:
    given = cloud((-1e30, 0, 0), (1e30, 1e30, 1e30), (1e30, 1e30, 1e30), (0, 0, 0))
    assert len(points_of(filters.voxel_grid(given, {**GRID, "leaf_size": 1e-6}))) == 3
    with pytest.raises(InvalidCloud, match="leaf sizes must be greater than 0, got 0"):
        filters.voxel_grid(given, {**GRID, "leaf_size": 0.0})


def test_indices_choose_points_in_their_order() -> None:
    given = cloud((0, 0, 0), (1, 0, 0), (2, 0, 0))
    assert [x for x, _, _ in points_of(filters.extract_indices(given, [2, 0], {"negative": False}))] == [2, 0]
    assert [x for x, _, _ in points_of(filters.extract_indices(given, [2, 0], {"negative": True}))] == [1]
    with pytest.raises(InvalidCloud, match="indices must be >= 0 and < 3, got -1 to 3"):
        filters.extract_indices(given, [3, -1], {"negative": False})


def test_outliers_by_a_plain_loop() -> None:
    numbers = np.random.default_rng(1)
    table = numbers.normal(0, 1, (60, 3)).astype(np.float32)
    given = cloud(*map(tuple, table))
    means = []
    for each in table:
        distances = sorted(math.dist(each, other) for other in table)
        means.append(sum(distances[1:5]) / 4)
    limit = np.mean(means) + 0.8 * np.std(means, ddof=1)
    expected = [tuple(map(float, each)) for each, mean in zip(table, means, strict=True) if mean <= limit]
    values = {"mean_k": 5, "stddev": 0.8, "negative": False}
    assert points_of(filters.statistical_outlier_removal(given, values)) == expected


def test_points_and_viewpoints_are_moved() -> None:
    pose = (1.0, 2.0, 3.0, 0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))
    zero = np.zeros(2, np.float32)
    found = transformed(cloud((1, 0, 0), (NAN, 0, 0), vp_x=zero, vp_y=zero, vp_z=zero), exact_matrix_of(pose))
    assert points_of(found)[0] == pytest.approx((1, 3, 3))
    assert [float(column(found, rows_of(found), name)[0]) for name in ("vp_x", "vp_y", "vp_z")] == [1, 2, 3]


def test_a_floor_is_found_among_outliers() -> None:
    numbers = np.random.default_rng(2)
    floor = np.stack([*numbers.uniform(-5, 5, (2, 300)), np.full(300, 0.5)], 1)
    found = plane(np.concatenate([floor, numbers.uniform(-5, 5, (100, 3)), [[NAN] * 3]]), 0.01, 500)
    assert found is not None
    assert abs(found[0][2]) == pytest.approx(1.0, abs=1e-4)
    assert abs(found[0][3]) == pytest.approx(0.5, abs=1e-3)
    assert set(range(300)) <= set(found[1])
    assert plane(floor[:2], 0.01) is None
    assert plane(np.zeros((10, 3)), 0.01) is None


def test_clusters_by_a_plain_loop() -> None:
    table = np.random.default_rng(3).uniform(0, 1, (200, 3))
    table[7] = NAN
    left, expected = set(range(200)) - {7}, []
    while left:
        group, border = set(), {left.pop()}
        while border:
            one = border.pop()
            group.add(one)
            near = {other for other in left if math.dist(table[one], table[other]) <= 0.12}
            left -= near
            border |= near
        expected.append(sorted(group))
    found = [each.tolist() for each in clusters(table, 0.12, 1, 1000)]
    assert sorted(found) == sorted(expected)
    assert [len(each) for each in found] == sorted(map(len, expected), reverse=True)
    assert all(3 <= len(each) <= 5 for each in clusters(table, 0.12, 3, 5))
    assert clusters(table[:0], 0.1, 1, 9) == []


def test_equal_points_are_one_place_in_a_cluster() -> None:
    origin = np.zeros((100_000, 3), np.float32)  # 10**10 pairs of neighbors

    found = clusters(np.concatenate([origin, origin[:2] + 9]), 0.1, 1, 10**9)

    assert [each.tolist() for each in found] == [list(range(100_000)), [100_000, 100_001]]


def test_points_without_bytes_are_refused() -> None:
    cloud: Any = load_message_class("sensor_msgs/PointCloud2")(width=2**32 - 1, height=2**32 - 1)

    with pytest.raises(InvalidCloud, match="point_step of a cloud must be > 0, got 0"):
        rows_of(cloud)


def test_many_neighbors_are_joined_in_parts() -> None:
    table = np.concatenate([np.linspace((at, 0, 0), (at, 1, 0), 40) for at in range(3)])
    assert [len(each) for each in clusters(table, 0.2, 1, 999, pairs=50)] == [40, 40, 40]


def strange_cloud(numbers: Any) -> Any:
    """Return a cloud with any fields, types, sizes and values."""
    field: Any = load_message_class("sensor_msgs/PointField")
    made: Any = load_message_class("sensor_msgs/PointCloud2")()
    made.point_step = int(numbers.choice([0, 1, 12, 16, 18]))
    made.height, made.width = int(numbers.integers(3)), int(numbers.integers(30))
    names = [*"xyz", *numbers.choice(["rgb", "ring", "x", "vp_x", "vp_y", "vp_z"], 3)]
    for index, name in enumerate(names):
        kind = 7 if numbers.random() < 0.9 else int(numbers.integers(12))
        offset = 4 * index if numbers.random() < 0.9 else int(numbers.choice([0, 3, 15, 2**31]))
        made.fields.append(field(str(name), offset, kind, int(numbers.integers(4))))
    made.is_bigendian = bool(numbers.random() < 0.2)
    size = made.height * made.width * made.point_step
    size += 0 if numbers.random() < 0.9 else int(numbers.integers(-5, 9))
    values = np.array([0, 1, -1, 1e-30, 3e38, -3e38, NAN, math.inf], np.float32)
    made.data = numbers.choice(values, max(size, 0) // 4 + 1).tobytes()[: max(size, 0)]
    return made


FILTERS: list[Callable[[Any], Any]] = [
    lambda given: filters.pass_through(given, LIMITS),
    lambda given: filters.pass_through(given, {**ORGANIZED, "filter_field_name": "ring"}),
    lambda given: filters.crop_box(given, BOX),
    lambda given: filters.extract_indices(given, [0, 5], {"negative": True}),
    lambda given: filters.statistical_outlier_removal(
        given, {"mean_k": 100, "stddev": 1.0, "negative": False}
    ),
    lambda given: filters.voxel_grid(given, GRID),
    lambda given: transformed(given, exact_matrix_of((1, 2, 3, 0, 0, 0, 1))),
    lambda given: plane(positions(given, rows_of(given)), 0.1) and given,
    lambda given: clusters(positions(given, rows_of(given)), 0.1, 0, 99) and given,
]


@pytest.mark.parametrize("index", range(len(FILTERS)))
def test_strange_clouds_are_filtered_or_refused(index: int) -> None:
    numbers, accepted = np.random.default_rng(1), 0
    for _ in range(300):
        given = strange_cloud(numbers)
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                found = FILTERS[index](given)
        except InvalidCloud:
            continue
        accepted += 1
        if hasattr(found, "data"):
            assert len(found.data) == found.width * found.height * found.point_step
    assert accepted > 5


# Files of point clouds; tests.interop.test_clouds_as_genuine exchanges them with PCL.


TEXT = b"""# .PCD v0.7
VERSION 0.7
FIELDS x y _ n
SIZE 4 4 1 2
TYPE F F U I
COUNT 1 1 2 1
WIDTH 2
HEIGHT 1
VIEWPOINT 1 2 3 1 0 0 0
POINTS 2
DATA ascii
0.5 nan 0 0 -7
1 2e3 0 0 300
"""


def example(count: int = 50) -> Any:
    columns = {
        "x": np.linspace(0, 1, count, dtype=np.float32), "t": np.arange(count) / 3,
        "ring": np.arange(count, dtype=np.uint16), "label": np.arange(count, dtype=np.int8),
    }  # fmt: skip
    header: Any = load_message_class("std_msgs/Header")()
    return cloud_of(header, columns, 20)


def test_text_with_padding_is_read() -> None:
    cloud, viewpoint = parse(TEXT)
    rows = rows_of(cloud)
    assert [(each.name, each.offset, each.datatype) for each in cloud.fields] == [
        ("x", 0, 7), ("y", 4, 7), ("n", 10, 3),
    ]  # fmt: skip
    assert column(cloud, rows, "x").tolist() == [0.5, 1.0]
    assert column(cloud, rows, "n").tolist() == [-7, 300]
    assert (cloud.is_dense, viewpoint) == (False, (1, 2, 3, 0, 0, 0, 1))


@pytest.mark.parametrize("mode", MODES)
def test_what_is_written_is_read_again(mode: str) -> None:
    given = example()
    cloud, viewpoint = parse(formatted(given, mode, (1, 2, 3, 0.5, 0.5, 0.5, 0.5)))
    assert viewpoint == (1, 2, 3, 0.5, 0.5, 0.5, 0.5)
    for name in ("x", "t", "ring", "label"):
        mine, read = column(given, rows_of(given), name), column(cloud, rows_of(cloud), name)
        assert mine.dtype == read.dtype
        assert np.allclose(mine, read, rtol=1e-7 if mode == "ascii" else 0, atol=0)
    empty, _ = parse(formatted(example(0), mode))
    assert empty.width == 0


def test_compressed_data_with_repetitions_is_read() -> None:
    """Literals `abc`, then 9 bytes from 3 back, then 14 bytes with a long length."""
    header = TEXT.replace(b"ascii", b"binary_compressed").partition(b"DATA")[0]
    header = header.replace(b"WIDTH 2", b"WIDTH 1").replace(b"COUNT 1 1 2 1", b"COUNT 1 1 16 1")
    packed = bytes([2, *b"abc", 7 << 5, 0, 2, 7 << 5, 5, 2])
    data = header + b"DATA binary_compressed\n" + len(packed).to_bytes(4, "little")
    cloud, _ = parse(data + (26).to_bytes(4, "little") + packed)
    assert rows_of(cloud).tobytes()[8:24] == (b"abc" * 9)[8:24]


@pytest.mark.parametrize(("old", "new", "text"), [
    (b"DATA ascii", b"DATA jpeg", "DATA must be one of ascii, binary, binary_compressed, got jpeg"),
    (b"DATA", b"DAYA", "must end with a DATA line"), (b"SIZE 4 4 1 2", b"SIZE 4 4 1", "header is malformed"),
    (b"SIZE 4 4 1 2", b"SIZE 4 3 1 2", "header is malformed"),
    (b"SIZE 4 4 1 2", b"SIZE 2 4 1 2", "must describe numbers"),
    (b"WIDTH 2", b"WIDTH 999999999", "WIDTH x HEIGHT must be 0 to"),
    (b"WIDTH 2", b"WIDTH 3", "with 3 points must have 15 values, got 10"),
    (b"300", b"70000", "value of field n is invalid"), (b"2e3", b"much", "value of field y is invalid"),
    (b"DATA ascii", b"DATA binary", "with 2 points must have"),
    (b"DATA ascii", b"DATA binary_compressed", "compressed data must be complete"),
])  # fmt: skip
def test_mistakes_are_named(old: bytes, new: bytes, text: str) -> None:
    with pytest.raises(InvalidPcd, match=text):
        parse(TEXT.replace(old, new).replace(b"0.5 nan 0 0 -7\n1 2e3 0 0 300\n", b"") if b"binary" in new
              else TEXT.replace(old, new))  # fmt: skip


def test_damaged_files_are_read_or_refused() -> None:
    numbers = np.random.default_rng(1)
    files = [TEXT, *(formatted(example(), mode) for mode in MODES)]
    for _ in range(1500):
        data = bytearray(files[numbers.integers(len(files))])
        for _ in range(numbers.integers(1, 6)):
            data[numbers.integers(len(data))] = numbers.integers(256)
        if numbers.random() < 0.3:
            del data[numbers.integers(len(data)) :]
        try:
            cloud, _ = parse(bytes(data))
        except InvalidPcd:
            continue
        assert len(cloud.data) == cloud.width * cloud.height * cloud.point_step
