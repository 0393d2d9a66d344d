"""With an edge value in any parameter, a node of navigation refuses to start and names it, or works.

As in `test_edge_values_in_messages`, callbacks are called directly, so that an exception fails the test.
"""

import logging
import math
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from typing import Any

import pytest

from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import InvalidParameter, PrivateParameters
from pipros_robot.navigation.amcl.amcl_node import AmclNode
from pipros_robot.navigation.costmap.costmap import Costmap
from pipros_robot.navigation.exploration.explore_node import ExploreNode
from pipros_robot.navigation.filter.filter_node import FilterNode
from pipros_robot.navigation.hector import hector_node
from pipros_robot.navigation.hector.hector_node import HectorNode
from pipros_robot.navigation.laser_matcher.laser_matcher_node import LaserMatcherNode
from pipros_robot.navigation.mapping.gmapping_node import GmappingNode
from pipros_robot.navigation.navsat.navsat_node import NavsatNode
from pipros_robot.navigation.pose_ekf.pose_ekf_node import PoseEkfNode
from pipros_robot.perception.drivers.urg_node import UrgNode
from pipros_robot.perception.laser.assembler_node import LaserScanAssembler
from pipros_robot.perception.laser.chain_node import ScanToCloudFilterChain, ScanToScanFilterChain
from tests.graph.unlinked import Unlinked
from tests.security.test_edge_values_in_messages import FILTER, FILTER_INPUTS, NAVSAT_INPUTS
from tests.security.test_edge_values_in_messages import make as make
from tests.support.unlinked_node import (
    BASE,
    Work,
    finite,
    imu,
    occupancy,
    odometry,
    posed,
    scan,
    transforms,
)

LOG = logging.getLogger("edge_values")
LOG.setLevel(logging.CRITICAL + 1)
EDGES: Mapping[str, tuple[Any, ...]] = {
    "number": (math.nan, math.inf, -math.inf, -1.0, 0.0, 1e9, 1e308),
    "integer": (-1, 0, 2**31 - 1),
    "numbers": ([], *([math.nan] * length for length in (3, 6, 15, 225))),
}
SCANS: Mapping[str, Any] = {"/scan": scan}
NODES: Mapping[str, tuple[Any, Mapping[str, Any], Mapping[str, Any]]] = {
    "amcl": (AmclNode, {"use_map_topic": True, "max_particles": 200, "save_pose_rate": -1.0,
                        "base_frame_id": BASE},
             {"/map": occupancy, "/initialpose": partial(posed, "map", 0.0), **SCANS}),
    "ekf": (partial(FilterNode, unscented=False), FILTER, FILTER_INPUTS),
    "ukf": (partial(FilterNode, unscented=True), FILTER, FILTER_INPUTS),
    "explore": (ExploreNode, {"robot_base_frame": BASE}, {"/costmap": occupancy}),
    "gmapping": (GmappingNode, {"base_frame": BASE, "particles": 2, "delta": 0.1, "temporalUpdate": 0.0,
                                "xmin": -3.0, "xmax": 3.0, "ymin": -3.0, "ymax": 3.0}, SCANS),
    "hector": (HectorNode, {"base_frame": BASE, "map_size": 128}, SCANS),
    "matcher": (LaserMatcherNode, {"base_frame": BASE}, {"/odom": odometry, **SCANS}),
    "navsat": (NavsatNode, {}, NAVSAT_INPUTS),
    "pose_ekf": (PoseEkfNode, {"vo_used": False}, {"/odom": odometry, "/imu_data": imu}),
}  # fmt: skip


def run(kind: str, node: Any, given: Mapping[str, Any]) -> bool:
    """Run a node with parameters. Return whether it sent messages, all of which were finite."""
    made, own, inputs = NODES[kind]
    with suppress(LookupError):
        node.params.delete("~")
    for name, value in {**own, **given}.items():
        node.params.set(f"~{name}", value)
    for each in (node.inputs, node.sent):
        each.clear()
    made(node, LOG, work := Work())
    for child in ("laser", "base_link", "gps"):
        node.give("/tf_static", transforms(BASE, child))
    for x in (0.0, 0.3, 0.6):
        messages = [(topic, good()) for topic, good in inputs.items()]
        node.give("/tf", transforms("odom", BASE, x))
        for topic, message in messages:
            node.give(topic, message)
        work.cycle()
    return all(map(finite, (sent for messages in node.sent.values() for sent in messages)))


def spied(kind: str, asked: dict[str, str]) -> Any:
    """Return a method of `PrivateParameters` that also notes which parameters it reads."""
    read = getattr(PrivateParameters, kind)

    def note(self: Any, name: str, *rest: Any, **options: Any) -> Any:
        asked[name] = kind
        return read(self, name, *rest, **options)

    return note


@pytest.mark.parametrize("kind", NODES)
def test_a_parameter_is_refused_by_its_name_or_harmless(
    make: Unlinked, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.setattr(hector_node, "TRANSFORM_S", 0.0)
    asked: dict[str, str] = {}
    for each in EDGES:
        monkeypatch.setattr(PrivateParameters, each, spied(each, asked))
    node = make(kind, {})
    assert run(kind, node, {})
    wrong = []
    asked.pop("delay", None)  # of navsat, which sleeps
    for name, value in [(name, value) for name, each in asked.items() for value in EDGES[each]]:
        try:
            if not run(kind, node, {name: value}):
                wrong.append(f"~{name} = {value}: an output is not finite")
        except InvalidParameter as error:
            if f"~{name}" not in str(error):
                wrong.append(f"~{name} = {value}: {error}")
        except Exception as error:
            wrong.append(f"~{name} = {value}: {type(error).__name__}: {error}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(("name", "made"), [
    ("notifier_tolerance", ScanToCloudFilterChain), ("tf_message_filter_tolerance", ScanToScanFilterChain),
    ("tf_cache_time_secs", LaserScanAssembler), ("diagnostics_window_time", partial(UrgNode, log=LOG)),
])  # fmt: skip
@pytest.mark.parametrize("value", [math.nan, -math.inf, 1e308])
def test_a_time_that_is_none_is_refused_by_its_name(
    make: Unlinked, name: str, made: Any, value: float
) -> None:
    node = make("perception", {name: value, "tf_message_filter_target_frame": "map", "ip_address": "::1"})
    with pytest.raises(InvalidParameter, match=f"~{name}"):
        made(node)


@pytest.mark.parametrize("name", ["width", "height", "resolution", "origin_y", "footprint_padding"])
@pytest.mark.parametrize("value", [-math.inf, math.inf])
def test_a_costmap_without_room_is_refused(make: Unlinked, name: str, value: float) -> None:
    node = make("costmap", {"costmap": {"robot_base_frame": BASE, "global_frame": "odom", name: value}})
    frames = Frames(node, LOG)
    node.give("/tf", transforms("odom", BASE))
    with pytest.raises(InvalidParameter, match=f"~costmap: .*{name}"):
        Costmap(node, LOG, frames, Work(), "costmap")  # type: ignore[arg-type]
