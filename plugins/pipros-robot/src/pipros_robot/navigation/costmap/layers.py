"""The layers of a costmap: their types, their parameters (including deprecated forms), and their topics."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from importlib.metadata import entry_points
from typing import Any, Final

from pipros.libraries.nodes.params import InvalidParameter, PrivateParameters, read_parameters, search_upwards
from pipros.libraries.nodes.wiring import advertise, stamped, subscribe
from pipros.libraries.reconfiguring.server import Reconfigurable
from pipros.libraries.transforms.errors import TransformException
from pipros.libraries.transforms.pose import Pose
from pipros.navigation.costmap.core import CostmapCore
from pipros.navigation.costmap.inflation_layer import InflationLayer
from pipros.navigation.costmap.layer_settings import INFLATION, OBSTACLE, SETTINGS, STATIC, VOXEL
from pipros.navigation.costmap.layered import Layer
from pipros.navigation.costmap.observations import ObservationSource, SourceSettings
from pipros.navigation.costmap.obstacle_layer import ObstacleLayer
from pipros.navigation.costmap.sensor_input import DATA_TYPES, SensorInput
from pipros.navigation.costmap.static_layer import StaticLayer, StaticSettings
from pipros.navigation.costmap.voxel_layer import VoxelLayer
from pipros.navigation.limits import NavigationLimits
from pipros.node.clock import stamp

ENTRY_POINTS: Final = "pipros.costmap_layers"


_TRACK: Final = "track_unknown_space"
_SHARED: Final[Mapping[str, tuple[str, ...]]] = {
    STATIC: ("map_topic", "unknown_cost_value", "lethal_cost_threshold", _TRACK),
    OBSTACLE: ("max_obstacle_height", "raytrace_range", "obstacle_range", _TRACK),
    VOXEL: (
        "origin_z", "z_resolution", "z_voxels", "mark_threshold", "unknown_threshold", "publish_voxel_map",
    ),
    INFLATION: ("cost_scaling_factor", "inflation_radius"),
}  # fmt: skip
"""Parameters of the costmap that each type of layer takes over."""


def add_layers(costmap: CostmapCore) -> list[SensorInput]:
    """Add the configured layers, and wait for the first map of each static layer.

    Return the subscriptions to sensors. If the parameter `plugins` is not set, `static_map` and `map_type`
    determine the layers, as they did before ROS Hydro.

    Raises:
        InvalidParameter: a layer's parameter is invalid, no layer can be used, or one cannot be used and
            `~strict` is set.
        Interrupted: the node was shut down while waiting.
    """
    given = costmap.given
    if given.has("plugins"):
        layers = _listed_layers(costmap, given)
    else:
        costmap.warn("plugins is not set: the layers are determined by deprecated parameters")
        layers = _old_layers(costmap, given)
    inputs: list[SensorInput] = []
    for name, kind in layers:
        inputs += LAYERS[kind](costmap, name, kind) if kind in LAYERS else _add_own(costmap, name, kind)
    return inputs


def _listed_layers(costmap: CostmapCore, given: PrivateParameters) -> list[tuple[str, str]]:
    for name in ("static_map", "map_type"):
        if given.has(name):
            costmap.warn("%s has no effect, because plugins is set", name)
    layers, listed, plugins = [], given.values["plugins"], f"{costmap.namespace}/plugins"
    entries = listed if isinstance(listed, list) else [listed]
    is_strict = read_parameters(costmap.node, "~").boolean("strict", False)
    for each in entries:
        problem = _problem_of(each)
        if not problem:
            layers.append((each["name"], each["type"]))
            shared = _SHARED.get(each["type"], ())
            _hand_down(costmap, given, each["name"], shared, kept=shared)
        elif is_strict:
            raise InvalidParameter(f"{plugins}: {problem}, and strict is set")
        else:
            costmap.log.error(
                "%s: %s: the layer is left out, and the robot does not see it", plugins, problem
            )
    if entries and not layers:
        raise InvalidParameter(f"{plugins} has no layer that pipros can use, got {str(listed)[:200]}")
    return layers


def _problem_of(entry: Any) -> str:
    """Return why an entry of `plugins` cannot be used; empty if it can."""
    if not (isinstance(entry, dict) and all(isinstance(entry.get(key), str) for key in ("name", "type"))):
        return f"it must be a list of {{name, type}}, got {str(entry)[:200]}"
    if entry["type"] in LAYERS:
        return ""
    try:
        if _own_layer(entry["type"]) is not None:
            return ""
    except Exception as error:  # the module belongs to another distribution
        return f"{entry['name']}: {entry['type']} cannot be imported: {type(error).__name__}: {error}"
    return (
        f"{entry['name']} has the type {entry['type']}, which is not part of pipros (layers in C++ cannot be "
        f"loaded); use one of {', '.join(LAYERS)}, install its Python layer (entry point {ENTRY_POINTS}), or "
        "remove it"
    )


def _own_layer(kind: str) -> Callable[[str, CostmapCore], Layer] | None:
    """Return the class of a layer that an installed package adds, or None."""
    for point in entry_points(group=ENTRY_POINTS, name=kind):
        found: Callable[[str, CostmapCore], Layer] = point.load()
        return found
    return None


def _add_own(costmap: CostmapCore, name: str, kind: str) -> list[SensorInput]:
    """Add a layer of an installed package. If it cannot be created, log an error and leave it out."""
    make = _own_layer(kind)
    try:
        layer = make(name, costmap) if make else None
        if not isinstance(layer, Layer):
            raise TypeError(
                f"it must be a pipros.navigation.costmap.layered.Layer, got {type(layer).__name__}"
            )
    except Exception as error:
        text = "%s/%s: the layer [%s] is left out, and the robot does not see it: %s: %s"
        costmap.log.error(text, costmap.namespace, name, kind, type(error).__name__, error)
        return []
    layer.is_enabled = read_parameters(costmap.node, f"{costmap.namespace}/{name}").boolean("enabled", True)
    costmap.layered.layers.append(layer)
    return []


def _hand_down(
    costmap: CostmapCore,
    given: PrivateParameters,
    layer: str,
    names: tuple[str, ...],
    kept: tuple[str, ...] = (),
) -> None:
    """Move parameters of the costmap to one of its layers, but copy the parameters in `kept`."""
    params, namespace = costmap.node.params, costmap.namespace
    for name in filter(given.has, names):
        params.set(f"{namespace}/{layer}/{name}", given.values[name])
        if name not in kept:
            params.delete(f"{namespace}/{name}")


def _old_layers(costmap: CostmapCore, given: PrivateParameters) -> list[tuple[str, str]]:
    layers = []
    if given.boolean("static_map", False):
        layers.append(("static_layer", STATIC))
        _hand_down(costmap, given, "static_layer", _SHARED[STATIC], kept=(_TRACK,))
    is_voxel = given.text("map_type", "costmap") == "voxel"
    layers += [("obstacle_layer", VOXEL if is_voxel else OBSTACLE), ("inflation_layer", INFLATION)]
    sources = dict.fromkeys(given.text("observation_sources", "").split())
    names = (*_SHARED[OBSTACLE], "observation_sources", *sources, *(_SHARED[VOXEL] if is_voxel else ()))
    _hand_down(costmap, given, "obstacle_layer", names)
    _hand_down(costmap, given, "inflation_layer", _SHARED[INFLATION])
    plugins = [{"name": name, "type": kind} for name, kind in layers]
    costmap.node.params.set(f"{costmap.namespace}/plugins", plugins)
    return layers


def _serve(
    costmap: CostmapCore, kind: str, layer: Layer, apply: Callable[[Mapping[str, Any]], object] | None = None
) -> None:
    """Serve the reconfigurable settings of a layer."""

    def change(values: Mapping[str, Any], _: int) -> None:
        with costmap.lock:
            layer.is_enabled = values["enabled"]
            if apply is not None:
                apply(values)

    Reconfigurable(costmap.node, f"{costmap.namespace}/{layer.name}", SETTINGS[kind], change)


def _add_inflation(costmap: CostmapCore, name: str, kind: str) -> list[SensorInput]:
    layer = InflationLayer(name, costmap.layered)
    costmap.layered.layers.append(layer)

    def apply(values: Mapping[str, Any]) -> None:
        radius, scaling = values["inflation_radius"], values["cost_scaling_factor"]
        layer.configure(radius=radius, scaling=scaling, inflate_unknown=values["inflate_unknown"])

    _serve(costmap, kind, layer, apply)
    return []


def _add_static(costmap: CostmapCore, name: str, kind: str) -> list[SensorInput]:
    def find_map(frame: str) -> Pose | None:
        try:
            return costmap.frames.at(frame.lstrip("/"), costmap.global_frame, 0)
        except TransformException as error:
            costmap.warn("the static map is not used: %s", error)
            return None

    node, namespace = costmap.node, f"{costmap.namespace}/{name}"
    settings = read_parameters(node, namespace).read(StaticSettings)
    layer = StaticLayer(name, costmap.layered, settings, find_map)
    costmap.layered.layers.append(layer)
    limit = node.limits.of(NavigationLimits).costmap_cells

    def take(accept: Any, message: Any) -> None:
        try:
            with costmap.lock:
                if accept == layer.set_map and settings.first_map_only and layer.map_frame is not None:
                    return
                if len(message.data) > limit:
                    cells = f"{limit} cells (PIPROS_LIMITS, costmap_cells)"
                    raise ValueError(f"a map must have at most {cells}, got {len(message.data)}")
                accept(message)
        except ValueError as error:
            costmap.log.error("%s: %s", namespace, error)

    topic = settings.map_topic
    costmap.log.info("%s waits for a map on %s", namespace, topic)
    subscribe(node, topic, "nav_msgs/OccupancyGrid", partial(take, layer.set_map))
    costmap.wait_until(lambda: layer.map_frame is not None, f"a map on {node.resolve(topic)}")
    if settings.subscribe_to_updates:
        update = "map_msgs/OccupancyGridUpdate"
        subscribe(node, f"{topic}_updates", update, partial(take, layer.set_part), 10)
    _serve(costmap, kind, layer)
    return []


def _add_obstacles(costmap: CostmapCore, name: str, kind: str) -> list[SensorInput]:
    node, namespace = costmap.node, f"{costmap.namespace}/{name}"
    given = read_parameters(node, namespace)
    tracks_unknown = given.boolean(_TRACK, costmap.layered.tracks_unknown)
    now_ns: Callable[[], int] = lambda: node.clock.now_ns()  # noqa: E731 # the clock may be replaced
    layer: ObstacleLayer = (VoxelLayer if kind == VOXEL else ObstacleLayer)(
        name, costmap.layered, now_ns, tracks_unknown=tracks_unknown, warn=costmap.warn
    )
    if isinstance(layer, VoxelLayer) and given.boolean("publish_voxel_map", False):
        publisher = advertise(node, f"{namespace}/voxel_grid", "costmap_2d/VoxelGrid")
        layer.after_update = lambda: publisher.publish(_voxel_grid(costmap, layer))
    costmap.layered.layers.append(layer)
    names = given.text("observation_sources", "").split()
    layer.sources += [
        ObservationSource(_source_settings(costmap, f"{namespace}/{each}", each)) for each in names
    ]
    inputs = [SensorInput(costmap, source) for source in layer.sources]

    def receive() -> None:
        for each in inputs:
            each.process()

    def apply(values: Mapping[str, Any]) -> None:
        layer.clears_footprint = values["footprint_clearing_enabled"]
        layer.max_height = values["max_obstacle_height"]
        layer.combination = values["combination_method"]
        if isinstance(layer, VoxelLayer):
            layer.configure(values)

    layer.before_update = receive
    _serve(costmap, kind, layer, apply)
    return inputs


LAYERS: Final[Mapping[str, Callable[[CostmapCore, str, str], list[SensorInput]]]] = {
    STATIC: _add_static,
    OBSTACLE: _add_obstacles,
    VOXEL: _add_obstacles,
    INFLATION: _add_inflation,
}
"""The types of layers, with functions that add one and return its subscriptions to sensors.

Installed packages add others by the entry point `pipros.costmap_layers`.
"""


def _voxel_grid(costmap: CostmapCore, layer: VoxelLayer) -> Any:
    """Return the voxels of a layer as costmap_2d/VoxelGrid."""
    grid = layer.columns
    message = stamped("costmap_2d/VoxelGrid", costmap.global_frame, stamp(costmap.node.clock))
    message.data = grid.costs.ravel().tolist()
    message.origin.x, message.origin.y, message.origin.z = grid.origin_x, grid.origin_y, layer.origin_z
    message.resolutions.x = message.resolutions.y = grid.resolution
    message.resolutions.z = layer.z_resolution
    message.size_x, message.size_y, message.size_z = grid.width, grid.height, layer.z_voxels
    return message


def _source_settings(costmap: CostmapCore, namespace: str, name: str) -> SourceSettings:
    given = read_parameters(costmap.node, namespace)
    found = {
        each: search_upwards(costmap.node, namespace, each) for each in ("obstacle_range", "raytrace_range")
    }
    values = PrivateParameters({**given.values, **found})
    frame = given.text("sensor_frame", "").lstrip("/")
    settings = values.read(SourceSettings, topic=given.text("topic", name), sensor_frame=frame)
    if settings.data_type not in DATA_TYPES:
        expected = f"one of {', '.join(DATA_TYPES)}"
        raise InvalidParameter(f"{namespace}/data_type must be {expected}, got {settings.data_type}")
    return settings
