"""costmap_2d_node as a program: it says why it cannot run."""

from __future__ import annotations

from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.node import Node
from tests.support.ros import RosSystem


@pytest.mark.parametrize(("parameters", "complaint"), [
    (
        {"plugins": [{"name": "range", "type": "range_sensor_layer::RangeSensorLayer"}]},
        "range_sensor_layer::",
    ),
    ({"plugins": "static"}, "must be a list of {name, type}, got static"),
    ({"footprint": "[[1, 2]]"}, "footprint must be a list of 3 to 1000 corners"),
    ({"observation_sources": "a", "a": {"data_type": "Range"}}, "data_type must be one of PointCloud, "),
])  # fmt: skip
def test_a_costmap_that_cannot_run_says_why(
    ros: RosSystem, parameters: dict[str, Any], complaint: str
) -> None:
    ros.serve_master()

    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        node.params.set("/costmap_node/costmap", {"robot_base_frame": "map", **parameters})
        ended = ros.pipros.run("rosrun", "costmap_2d", "costmap_2d_node")
    assert ended.returncode == 1
    assert complaint in ended.output
    assert "Traceback" not in ended.output
