"""The filters of laser_filters and the assembler, on recorded scans, beside the genuine ones."""

import math
from typing import Any

from pipros.msg.time import Time
from pipros_robot.perception.laser.assembler_node import LaserScanAssembler
from pipros_robot.perception.laser.chain_node import ScanToCloudFilterChain, ScanToScanFilterChain
from pipros_robot.perception.laser.filters.chain import TYPES
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.twin_nodes import Twins, differences, twins
from tests.support.waiting import wait_until

CORNERS = [[1.0, 2.0], [-1.5, 1.0], [-0.5, -2.0], [2.0, -1.0]]
BOX = {
    "box_frame": "base", "min_x": -1.0, "max_x": 2.0, "min_y": -2.0, "max_y": 2.0, "min_z": -1.0, "max_z": 1,
}  # fmt: skip


def over_time(kind: str, count: int) -> list[dict[str, Any]]:
    params = {"number_of_observations": count}
    return [{"name": "inner", "type": f"filters/MultiChannel{kind}FilterFloat", "params": params}]


FILTERS: dict[str, tuple[str, dict[str, Any]]] = {
    "range": ("LaserScanRangeFilter", {
        "lower_threshold": 0.3, "upper_threshold": 4, "lower_replacement_value": math.nan,
        "upper_replacement_value": math.inf,
    }),
    "range_of_message": ("LaserScanRangeFilter", {"use_message_range_limits": True}),
    "intensity": ("LaserScanIntensityFilter", {"lower_threshold": 30, "upper_threshold": 80}),
    "intensity_inverted": ("LaserScanIntensityFilter", {
        "lower_threshold": 30, "upper_threshold": 80, "invert": True, "filter_override_intensity": True,
    }),
    "bounds": ("LaserScanAngularBoundsFilter", {"lower_angle": -0.7, "upper_angle": 1.1}),
    "bounds_wide": ("LaserScanAngularBoundsFilter", {"lower_angle": -7, "upper_angle": 9}),
    "bounds_beyond": ("LaserScanAngularBoundsFilter", {"lower_angle": 3.5, "upper_angle": 9}),
    "in_place": ("LaserScanAngularBoundsFilterInPlace", {"lower_angle": -0.7, "upper_angle": 1.1}),
    "sector": ("LaserScanSectorFilter", {
        "angle_min": -0.7, "angle_max": 1.1, "range_min": 1.0, "range_max": 4.0,
    }),
    "sector_outside": ("LaserScanSectorFilter", {
        "angle_min": 0.7, "angle_max": -1.1, "range_min": 1.0, "range_max": 4.0, "clear_inside": False,
    }),
    "sector_inverted": ("LaserScanSectorFilter", {
        "angle_min": 0.7, "angle_max": -1.1, "clear_inside": False, "invert": True,
    }),
    "box": ("LaserScanBoxFilter", BOX),
    "box_inverted": ("LaserScanBoxFilter", {**BOX, "invert": True}),
    "polygon": ("LaserScanPolygonFilter", {
        "polygon": CORNERS, "polygon_frame": "base", "polygon_padding": 0.1,
    }),
    "polygon_inverted": ("LaserScanPolygonFilter", {
        "polygon": CORNERS, "polygon_frame": "base", "invert": True,
    }),
    "static_polygon": ("StaticLaserScanPolygonFilter", {
        "polygon": CORNERS, "polygon_frame": "base", "polygon_padding": 0.1,
    }),
    "shadows": ("ScanShadowsFilter", {"min_angle": 10, "max_angle": 170, "neighbors": 2, "window": 1}),
    "shadows_and_start": ("ScanShadowsFilter", {
        "min_angle": 15.0, "max_angle": 150.0, "neighbors": 3, "window": 4, "remove_shadow_start_point": True,
    }),
    "speckle": ("LaserScanSpeckleFilter", {
        "max_range": 3.0, "max_range_difference": 0.2, "filter_window": 2,
    }),
    "speckle_radius": ("LaserScanSpeckleFilter", {  # the type is that of its namespace, see below
        "filter_type": 1, "max_range": 1.8, "max_range_difference": 0.5, "filter_window": 3,
    }),
    "interpolation": ("InterpolationFilter", {}),
    "mask": ("LaserScanMaskFilter", {"masks": {"laser": [0, 3, 5, 100, 100000], "other": [1]}}),
    "footprint": ("LaserScanFootprintFilter", {"inscribed_radius": 1.5}),
    "blob": ("ScanBlobFilter", {"max_radius": 0.3, "min_points": 3}),
    "arrays": ("LaserArrayFilter", {
        "range_filter_chain": over_time("Median", 3), "intensity_filter_chain": over_time("Mean", 4),
    }),
    "median": ("LaserMedianFilter", {"internal_filter": over_time("Median", 4)}),
}  # fmt: skip


def test_every_filter_gives_the_same_scans(ros: RosSystem, recording: Recording) -> None:
    program = ["laser_filters", "scan_to_scan_filter_chain"]
    outputs = {"scan_filtered": "sensor_msgs/LaserScan"}
    with twins(ros, recording) as both:
        both.publish_next("/tf_static")
        for name, (kind, params) in FILTERS.items():
            chain = [{"name": "one", "type": f"laser_filters/{kind}", "params": params}]
            parameters: dict[str, Any] = {"scan_filter_chain": chain}
            if name == "speckle_radius":
                parameters["one"] = {"filter_type": 1}
            both.add(name, ScanToScanFilterChain, program, parameters, {"scan": "/scan"}, outputs)
        first = both.publish_next("/scan")
        both.warm_up(lambda: both.publish("/scan", first))
        for _ in range(10):  # until filters over time have forgotten other scans
            both.publish("/scan", first)
        for _ in range(9):
            both.publish_next("/scan")
        for name, (kind, _) in FILTERS.items():
            if TYPES[kind].is_reconfigurable:
                mine, his = both.settings(f"{name}/one")
                assert mine == his, name
            ours, genuine = both.outputs(name, "scan_filtered", 9)
            found = [differences(*pair) for pair in zip(ours, genuine, strict=True)]
            assert not any(found), f"{name}: {[each[:5] for each in found]}"


LIMITED = [
    {"name": "limits", "type": "laser_filters/LaserScanRangeFilter",
        "params": {"lower_threshold": 1.0, "upper_threshold": 4.0}},
]  # fmt: skip


def test_scans_of_a_moving_robot_become_the_same_clouds(ros: RosSystem, recording: Recording) -> None:
    program = ["laser_filters", "scan_to_cloud_filter_chain"]
    cases: dict[str, dict[str, Any]] = {
        "default": {"target_frame": "odom"},
        "filtered": {
            "target_frame": "base_link", "scan_filter_chain": LIMITED, "incident_angle_correction": False,
            "cloud_channel_viewpoint": True,
        },
        "near": {"target_frame": "odom", "laser_max_range": 2.0, "cloud_channel_index": False},
    }  # fmt: skip
    assemblers: dict[str, dict[str, Any]] = {
        "static": {"fixed_frame": "odom", "max_scans": 5},
        "moving": {"fixed_frame": "odom", "ignore_laser_skew": False, "filters": LIMITED},
        "thinned": {"fixed_frame": "laser", "downsample_factor": 3},
    }
    scans = {"scan": "/scan"}
    with twins(ros, recording) as both:
        for name, parameters in cases.items():
            outputs = {"cloud_filtered": "sensor_msgs/PointCloud2"}
            both.add(name, ScanToCloudFilterChain, program, parameters, scans, outputs)
        program = ["laser_assembler", "laser_scan_assembler"]
        for name, parameters in assemblers.items():
            services = {each: f"{name}_{each}" for each in ("build_cloud", "assemble_scans")}
            services |= {f"{old}2": f"{new}2" for old, new in services.items()}
            both.add(name, LaserScanAssembler, program, parameters, scans, {}, services)
        both.expect("/tf", len(cases | assemblers))
        both.publish_next("/tf_static")
        for _ in range(40):
            both.publish_next("/tf")
        for count in range(1, 9):
            both.publish_next("/scan")
            for name in cases:
                both.outputs(name, "cloud_filtered", count)
        for name in cases:
            ours, genuine = both.outputs(name, "cloud_filtered", 8)
            found = [differences(*pair) for pair in zip(ours, genuine, strict=True)]
            assert not any(found), f"{name}: {[each[:5] for each in found]}"
        for name in assemblers:
            assert_same_assembled(both, name)


def assert_same_assembled(both: Twins, name: str) -> None:
    """Assert that both assemblers give equal clouds for intervals with all, some and no scans."""
    for form in ("", "2"):

        def clouds(begin_s: float, end_s: float, form: str = form) -> list[Any]:
            times = [Time(*divmod(round(at * 1e9), 10**9)) for at in (begin_s, end_s)]
            kind = f"laser_assembler/AssembleScans{form}"
            return [each.cloud for each in both.call(f"{name}_assemble_scans{form}", kind, *times)]

        wait_until(lambda: not differences(*clouds(0, 2000)), 30, lambda: str(differences(*clouds(0, 2000))))
        assert len(clouds(0, 2000)[0].fields if form else clouds(0, 2000)[0].points) > 0
        for begin_s, end_s in ((1000.25, 1000.65), (1000.5, 1000.5), (1500, 1600)):
            assert not differences(*clouds(begin_s, end_s))
