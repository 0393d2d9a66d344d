"""The parameter `plugins` of a costmap: an entry that pipros cannot use is left out, with an error."""

from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.node import Node
from pipros_libraries.nodes.params import InvalidParameter, read_parameters
from pipros_robot.navigation.costmap.layers import INFLATION, STATIC, _listed_layers
from tests.support.nodes import MakeNode, listening_log
from tests.support.ros import RosSystem

GOOD = [{"name": "walls", "type": STATIC}, {"name": "inflation", "type": INFLATION}]
BAD: dict[str, Any] = {
    "its own layer": {"name": "depth", "type": "fetch_depth_layer/FetchDepthLayer"},
    "no type": {"name": "depth"}, "a number as a name": {"name": 7, "type": STATIC}, "a text": "depth",
}  # fmt: skip


def layers_of(
    make_node: MakeNode, plugins: Any, **parameters: Any
) -> tuple[list[tuple[str, str]], list[str], list[str]]:
    """Return the layers to use, the names of those that are left out, and the lines in the log."""
    node = make_node("costmap")
    for name, value in {"costmap/plugins": plugins, **parameters}.items():
        node.params.set(f"~{name}", value)
    log, lines = listening_log()
    costmap: Any = SimpleNamespace(node=node, namespace="~costmap", log=log, warn=log.warning)
    return *_listed_layers(costmap, read_parameters(node, "~costmap")), lines


@pytest.mark.parametrize("place", range(3))
@pytest.mark.parametrize("bad", BAD)
def test_an_entry_that_pipros_cannot_use_is_left_out(
    bad: str, place: int, master: Master, make_node: MakeNode
) -> None:
    plugins = [*GOOD]
    plugins.insert(place, BAD[bad])
    layers, left_out, lines = layers_of(make_node, plugins)
    assert layers == [(each["name"], each["type"]) for each in GOOD]
    assert left_out == [str(BAD[bad]["name"] if isinstance(BAD[bad], dict) else BAD[bad])]
    (line,) = lines
    assert line.startswith("~costmap/plugins: ")
    assert line.endswith("the layer is left out, and the robot does not see it")
    if isinstance(BAD[bad], dict):
        assert str(BAD[bad]["name"]) in line


def test_with_strict_such_an_entry_ends_the_node(master: Master, make_node: MakeNode) -> None:
    with pytest.raises(InvalidParameter, match=r"FetchDepthLayer.*strict is set"):
        layers_of(make_node, [*GOOD, BAD["its own layer"]], strict=True)


def test_a_costmap_without_a_usable_layer_ends_the_node(master: Master, make_node: MakeNode) -> None:
    with pytest.raises(InvalidParameter, match="has no layer that pipros can use"):
        layers_of(make_node, [BAD["its own layer"]])
    assert layers_of(make_node, [])[:2] == ([], [])


# costmap_2d_node as a program: it says why it cannot run.


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
