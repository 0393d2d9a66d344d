"""The nodelets and programs of pcl_ros of both sides, on the same clouds."""

import json
import math
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipros.msg import load_message_class
from pipros_robot.perception.clouds import filter_nodes, segmentation_nodes
from pipros_robot.perception.clouds.pcd import formatted, parse
from pipros_robot.perception.clouds.pcd_nodes import CloudWriter
from pipros_robot.perception.clouds.points import cloud_of, column, positions, rows_of
from tests.interop.programs.examine_clouds import __file__ as script
from tests.interop.programs.examine_clouds import examine_many
from tests.support.ros import RosSystem, Side
from tests.support.twin_nodes import Twins, differences, twins
from tests.support.waiting import wait_until

NODELET = "/usr/lib/nodelet/nodelet"
CLOUD = "sensor_msgs/PointCloud2"
INDICES = "pcl_msgs/PointIndices"


@pytest.fixture
def genuine(plain_ros: RosSystem, tmp_path: Path) -> Side:
    """The genuine side, with a prefix in which Debian's plugins of pcl_ros are found.

    Their descriptions name `lib/libpcl_ros_filters`, but the libraries are in `/usr/lib/x86_64-linux-gnu`.
    """
    (tmp_path / "prefix").mkdir()
    (tmp_path / "prefix" / "lib").symlink_to("/usr/lib/x86_64-linux-gnu")
    plain_ros.genuine.environment["CMAKE_PREFIX_PATH"] = f"{tmp_path / 'prefix'}:/usr"
    plain_ros.genuine.environment["ROS_PACKAGE_PATH"] = "/usr/share"
    return plain_ros.genuine


EXACT: dict[str, tuple[str, dict[str, Any]]] = {
    "default": ("PassThrough", {}),
    "intensity": ("PassThrough", {
        "filter_field_name": "intensity", "filter_limit_min": 20, "filter_limit_max": 70,
        "filter_limit_negative": True,
    }),
    "organized": ("PassThrough", {
        "filter_field_name": "x", "filter_limit_min": -2.0, "keep_organized": True,
    }),
    "copy": ("PassThrough", {"filter_field_name": "", "keep_organized": True}),
    "finite": ("PassThrough", {"filter_field_name": ""}),
    "missing": ("PassThrough", {"filter_field_name": "missing"}),
    "other_frame": ("PassThrough", {"filter_limit_min": -1.0, "input_frame": "base"}),
    "moved": ("PassThrough", {"filter_limit_min": -1.0, "output_frame": "base"}),
    "box": ("CropBox", {}),
    "outside": ("CropBox", {"min_x": -2.0, "max_z": 0.5, "negative": True}),
    "box_organized": ("CropBox", {"min_x": -2.0, "keep_organized": True}),
    "indices": ("ExtractIndices", {}),
    "others": ("ExtractIndices", {"negative": True}),
    "outliers": ("StatisticalOutlierRemoval", {"mean_k": 8, "stddev": 1.0}),
    "only_outliers": ("StatisticalOutlierRemoval", {"stddev": 0.5, "negative": True}),
    "box_indices": ("CropBox", {"min_x": -2.0, "use_indices": True}),
    "box_indices_organized": ("CropBox", {"min_x": -2.0, "use_indices": True, "keep_organized": True}),
    "pass_indices": ("PassThrough", {"use_indices": True}),
    "outlier_indices": ("StatisticalOutlierRemoval", {"mean_k": 8, "stddev": 1.0, "use_indices": True}),
    "no_deviation": ("StatisticalOutlierRemoval", {}),
}  # fmt: skip
GRIDS: dict[str, dict[str, Any]] = {
    "coarse": {"leaf_size": 0.3},
    "many_points": {"leaf_size": 0.5, "filter_field_name": "", "min_points_per_voxel": 3},
    "too_fine": {"leaf_size": 0.0001, "filter_field_name": ""},
    "limited": {"leaf_size": 0.5, "filter_field_name": "x", "filter_limit_negative": True},
}


def random_cloud(both: Twins, numbers: Any, index: int) -> Any:
    """Return a cloud with NaN, a field of another type, and padding; the second one is organized."""
    count = 2000
    points = numbers.normal(0, 1.5, (count, 3)).astype(np.float32)
    points[numbers.integers(0, count, 30)] = np.nan
    points[5, 1] = np.inf
    points[6] = np.nan, np.inf, 1
    columns = dict(zip("xyz", points.T, strict=True))
    columns["intensity"] = numbers.uniform(0, 100, count).astype(np.float32)
    columns["ring"] = numbers.integers(0, 64, count).astype(np.uint16)
    if index == 2:
        columns["rgb"] = numbers.integers(0, 2**24, count).astype(np.uint32).view(np.float32)
    cloud = cloud_of(both.next_header("lidar"), columns, 32)
    if index == 1:
        cloud.height, cloud.width, cloud.row_step = 20, 100, 3200
    return cloud


def add(both: Twins, name: str, kind: str, parameters: dict[str, Any], outputs: dict[str, str]) -> None:
    """Add a nodelet of pcl_ros of both sides."""
    inputs = {"~input": "/cloud"}
    if kind == "ExtractIndices" or parameters.get("use_indices"):
        inputs["~indices"] = "/indices"
    module = filter_nodes if hasattr(filter_nodes, kind) else segmentation_nodes
    made = getattr(module, kind.replace("SAC", "Sac"))
    both.add(name, made, [NODELET, "standalone", f"pcl/{kind}"], parameters, inputs, outputs)


def test_filters_give_the_same_points(plain_ros: RosSystem, genuine: Side) -> None:
    assert genuine.is_genuine
    numbers = np.random.default_rng(1)
    chosen = [numbers.permutation(2000)[:500], np.arange(2000), np.array([5, 3, 3, 1]), np.arange(0)]
    with twins(plain_ros) as both:
        both.transforms(("base", "lidar", (0.3, -0.1, 0.5), (0.1, -0.2, 0.3, 0.9)))
        grids = {name: ("VoxelGrid", parameters) for name, parameters in GRIDS.items()}
        for name, (kind, parameters) in {**EXACT, **grids}.items():
            add(both, name, kind, parameters, {"~output": CLOUD})
        indices_class: Any = load_message_class(INDICES)

        def publish(index: int, indices: Any) -> None:
            cloud = random_cloud(both, numbers, index)
            both.publish("/cloud", cloud)
            both.publish("/indices", indices_class(cloud.header, indices.tolist()))

        for name in ("default", "box", "indices", "outliers", "coarse"):
            mine, his = both.settings(name)
            assert mine == his, name
        both.warm_up(lambda: publish(0, chosen[0]))
        for index, indices in enumerate(chosen):
            publish(index, indices)
            for name in EXACT:
                ours, theirs = both.outputs(name, "~output", index + 1)
                found = differences(ours[index], theirs[index])
                assert not found, f"{name}, cloud {index}: {found[:5]}"
            for name in GRIDS:
                ours, theirs = both.outputs(name, "~output", index + 1)
                assert_same_set(ours[index], theirs[index])


def assert_same_set(one: Any, other: Any) -> None:
    """Assert that two clouds have the same points in any order, within 1e-5 m, with equal colours."""
    assert (one.width, one.height, one.is_dense) == (other.width, other.height, other.is_dense)
    tables = []
    for cloud in (one, other):
        points = positions(cloud, rows_of(cloud))
        order = np.lexsort(np.round(points, 3).T)
        tables.append((points[order], column(cloud, rows_of(cloud), "intensity")[order]))
    assert np.abs(tables[0][0] - tables[1][0]).max() < 1e-5
    assert np.abs(tables[0][1] - tables[1][1]).max() < 1e-3
    if any(each.name == "rgb" for each in one.fields) and one.width < 1000:
        colors = [column(cloud, rows_of(cloud), "rgb").copy().view(np.uint32) for cloud in (one, other)]
        assert np.array_equal(*colors)


def test_the_same_planes_and_clusters_are_found(plain_ros: RosSystem, genuine: Side) -> None:
    assert genuine.is_genuine
    numbers = np.random.default_rng(1)
    coefficients = "pcl_msgs/ModelCoefficients"
    with twins(plain_ros) as both:
        planes = {"model_type": 0, "distance_threshold": 0.05, "max_iterations": 500}
        add(both, "plane", "SACSegmentation", planes, {"~inliers": INDICES, "~model": coefficients})
        unrefined = {**planes, "optimize_coefficients": False, "distance_threshold": 0.03}
        add(both, "unrefined", "SACSegmentation", unrefined, {"~model": coefficients})
        clusters = {"cluster_tolerance": 0.3, "spatial_locator": 0, "cluster_min_size": 20}
        clusters["max_queue_size"] = 10  # by default 3: of four clusters, one can be dropped
        some = {"use_indices": True}
        add(both, "some_plane", "SACSegmentation", {**planes, **some}, {"~model": coefficients})
        add(both, "some_points", "EuclideanClusterExtraction", {**clusters, **some}, {"~output": CLOUD})
        add(both, "points", "EuclideanClusterExtraction", clusters, {"~output": CLOUD})
        add(both, "numbers", "EuclideanClusterExtraction", {**clusters, "publish_indices": True},
            {"~output": INDICES})  # fmt: skip

        def publish() -> None:
            floor = np.stack([*numbers.uniform(-3, 3, (2, 1500)), numbers.normal(0, 0.005, 1500)], 1)
            blobs = [numbers.normal((2 * at, 0, 2), 0.1, (60 * (at + 1), 3)) for at in range(3)]
            points = np.concatenate([floor, *blobs, numbers.uniform((-3, -3, 6), (3, 3, 12), (100, 3))])
            columns = dict(zip("xyz", points.astype(np.float32).T, strict=True))
            cloud = cloud_of(both.next_header("lidar"), columns, 16)
            both.publish("/cloud", cloud)
            both.publish("/indices", indices_class(cloud.header, list(range(0, len(points), 2))))

        indices_class: Any = load_message_class(INDICES)
        for name in ("plane", "points"):
            mine_settings, his_settings = both.settings(name)
            assert mine_settings == his_settings
        both.warm_up(publish)
        publish()
        for name in ("plane", "unrefined", "some_plane"):
            ours, theirs = (each[0].values for each in both.outputs(name, "~model"))
            cosine = abs(np.dot(ours[:3], theirs[:3]))
            assert math.degrees(math.acos(min(cosine, 1.0))) < 1.0
            assert abs(abs(ours[3]) - abs(theirs[3])) < 0.01
        one, other = (set(each[0].indices) for each in both.outputs("plane", "~inliers"))
        assert len(one ^ other) <= 15
        assert len(one) >= 1495
        for name in ("points", "some_points", "numbers"):
            pairs = list(zip(*both.outputs(name, "~output", 4), strict=True))
            for index, (mine, his) in enumerate(pairs[:4]):
                assert mine.header.stamp.to_nsec() == both.clock_ns + index * 10**6
                if name != "numbers":
                    assert sorted(map(tuple, positions(mine, rows_of(mine)))) == sorted(
                        map(tuple, positions(his, rows_of(his)))
                    )
                else:
                    assert list(mine.indices) == sorted(his.indices)


def test_files_are_written_and_read_by_both_sides(plain_ros: RosSystem, genuine: Side, tmp_path) -> None:
    numbers = np.random.default_rng(1)
    cases: dict[str, dict[str, Any]] = {
        "ascii": {}, "binary": {"binary": True}, "compressed": {"binary": True, "compressed": True},
    }  # fmt: skip
    with twins(plain_ros) as both:
        for name, parameters in cases.items():
            both.add(
                name, lambda node: CloudWriter(node, node.log), ["/usr/lib/pcl_ros/pointcloud_to_pcd"],
                parameters, {"input": "/cloud"}, {}, private={"prefix": f"{tmp_path}/SIDE_{name}_"},
            )  # fmt: skip
        cloud = random_cloud(both, numbers, 1)
        both.publish("/cloud", cloud)
        time_us = both.clock_ns // 1000
        for name in cases:
            paths = [tmp_path / f"{side}_{name}_{time_us}.pcd" for side in ("pipros", "genuine")]
            wait_until(lambda: all(each.exists() and each.stat().st_size for each in paths), what=str(paths))  # noqa: B023
            (ours, _), (theirs, _) = (wait_until(lambda: read(each)) for each in paths)  # noqa: B023
            for field in ("x", "y", "z", "intensity", "ring"):
                mine, his = (column(each, rows_of(each), field) for each in (ours, theirs))
                assert np.array_equal(mine, his, equal_nan=True)

        (tmp_path / "ours.pcd").write_bytes(formatted(cloud, "binary_compressed"))
        got: list[Any] = []
        node = genuine.start("/usr/lib/pcl_ros/pcd_to_pointcloud", tmp_path / "ours.pcd", "0.2")
        both.node.subscribe("/cloud_pcd", load_message_class(CLOUD), got.append)
        wait_until(lambda: got, what=lambda: f"a cloud: {node.output}")
        assert (got[0].height, got[0].width) == (20, 100)
        for field in ("x", "ring"):
            mine, his = (column(each, rows_of(each), field) for each in (cloud, got[0]))
            assert np.array_equal(mine, his, equal_nan=True)


def read(path: Path) -> Any:
    """Return the cloud in a file, or None while it is being written."""
    try:
        return parse(path.read_bytes())
    except ValueError:
        return None


# `sensor_msgs.point_cloud2` of pipros and of genuine ROS, on the same clouds.


def test_random_clouds_hold_the_same_points() -> None:
    asked = subprocess.run(
        ["/usr/bin/python3", script], env={"PATH": "/usr/bin:/bin"}, capture_output=True, check=True
    )

    assert examine_many(seed=1, count=300) == json.loads(asked.stdout)
