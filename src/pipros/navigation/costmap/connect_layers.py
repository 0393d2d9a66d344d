"""Make the layers of a costmap from their parameters, and connect them to their topics."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from pipros.libraries.reconfiguring.server import Reconfigurable
from pipros.libraries.transforms.errors import TransformException
from pipros.libraries.transforms.pose import Pose
from pipros.msg import load_message_class
from pipros.navigation.costmap.host import Host
from pipros.navigation.costmap.inflation_layer import InflationLayer
from pipros.navigation.costmap.layer_parameters import INFLATION, SETTINGS, STATIC, source_settings
from pipros.navigation.costmap.layered import Layer
from pipros.navigation.costmap.observations import Source
from pipros.navigation.costmap.obstacle_layer import ObstacleLayer
from pipros.navigation.costmap.sensor_input import SensorInput
from pipros.navigation.costmap.static_layer import StaticLayer, StaticSettings
from pipros.navigation.limits import NavigationLimits
from pipros.navigation.parameters import Parameters, read_parameters


def connect_layer(costmap: Host, name: str, kind: str) -> None:
    """Add a layer of a type to the costmap. A static layer waits for its first map.

    Raises:
        InvalidParameter: a parameter has a value with which the layer cannot work.
        Interrupted: the node was shut down while it waited.
    """
    namespace = f"{costmap.namespace}/{name}"
    parameters = read_parameters(costmap.node, namespace)
    if kind == STATIC:
        _connect_static(costmap, name, namespace, parameters)
    elif kind == INFLATION:
        inflation = InflationLayer(name, costmap.layered)
        costmap.layered.layers.append(inflation)
        _serve(costmap, namespace, kind, inflation, partial(_set_inflation, inflation))
    else:
        _connect_obstacles(costmap, name, namespace, kind, parameters)


def _serve(
    costmap: Host, namespace: str, kind: str, layer: Layer, apply: Callable[[Any], None] | None = None
) -> None:
    """Offer the settings of a layer."""

    def change(values: Mapping[str, Any], _: int) -> None:
        with costmap.lock:
            layer.is_enabled = values["enabled"]
            if apply is not None:
                apply(values)

    Reconfigurable(costmap.node, namespace, SETTINGS[kind], change)


def _set_inflation(layer: InflationLayer, values: Mapping[str, Any]) -> None:
    layer.configure(
        radius=values["inflation_radius"],
        scaling=values["cost_scaling_factor"],
        inflate_unknown=values["inflate_unknown"],
    )


def _connect_static(costmap: Host, name: str, namespace: str, parameters: Parameters) -> None:
    def find_map(frame: str) -> Pose | None:
        try:
            return costmap.frames.buffer.lookup(frame.lstrip("/"), costmap.global_frame, 0)[1]
        except TransformException as error:
            costmap.warn(f"the static map is not used: {error}")
            return None

    settings = StaticSettings(
        parameters.boolean("track_unknown_space", True),
        parameters.integer("lethal_cost_threshold", 100),
        parameters.integer("unknown_cost_value", -1),
        parameters.boolean("trinary_costmap", True),
        parameters.boolean("use_maximum", False),
    )
    layer = StaticLayer(name, costmap.layered, settings, find_map)
    costmap.layered.layers.append(layer)
    limit = costmap.node.limits.of(NavigationLimits).costmap_cells
    is_first_only = parameters.boolean("first_map_only", False)

    def take(accept: Any, message: Any) -> None:
        try:
            with costmap.lock:
                if accept == layer.set_map and is_first_only and layer.map_frame is not None:
                    return
                if len(message.data) > limit:
                    raise ValueError(f"a map must have at most {limit} cells (PIPROS_LIMITS, costmap_cells)")
                accept(message)
        except ValueError as error:
            costmap.log.error("%s: %s", namespace, error)

    topic = parameters.text("map_topic", "map")
    grid: Any = load_message_class("nav_msgs/OccupancyGrid")
    costmap.log.info("%s waits for a map on %s", namespace, topic)
    costmap.node.subscribe(topic, grid, partial(take, layer.set_map), queue_size=1)
    costmap.wait_until(lambda: layer.map_frame is not None, f"a map on {costmap.node.resolve(topic)}")
    if parameters.boolean("subscribe_to_updates", False):
        update: Any = load_message_class("map_msgs/OccupancyGridUpdate")
        costmap.node.subscribe(f"{topic}_updates", update, partial(take, layer.set_part), queue_size=10)
    _serve(costmap, namespace, STATIC, layer)


def _connect_obstacles(costmap: Host, name: str, namespace: str, kind: str, parameters: Parameters) -> None:
    node = costmap.node
    layer = ObstacleLayer(
        name,
        costmap.layered,
        lambda: node.clock.now_ns(),
        tracks_unknown=parameters.boolean("track_unknown_space", costmap.layered.tracks_unknown),
        warn=costmap.warn,
    )
    costmap.layered.layers.append(layer)
    inputs = []
    for settings in source_settings(node, namespace):
        source = Source(settings)
        layer.sources.append(source)
        inputs.append(
            SensorInput(node, costmap.log, costmap.frames, costmap.global_frame, source, costmap.lock)
        )
    costmap.inputs += inputs

    def receive() -> None:
        for each in inputs:
            each.process()

    def apply(values: Mapping[str, Any]) -> None:
        layer.clears_footprint = values["footprint_clearing_enabled"]
        layer.max_height = values["max_obstacle_height"]
        layer.combination = values["combination_method"]

    layer.before_update = receive
    _serve(costmap, namespace, kind, layer, apply)
