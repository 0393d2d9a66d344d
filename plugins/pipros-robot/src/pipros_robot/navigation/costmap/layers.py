"""The layers of a costmap: their types, their parameters (including deprecated forms), and their topics."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from importlib.metadata import entry_points
from typing import Any, Final

from pipros.node.clock import stamp
from pipros_libraries.nodes.params import InvalidParameter, PrivateParameters, read_parameters, search_upwards
from pipros_libraries.nodes.wiring import advertise, stamped, subscribe
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.pose import Pose
from pipros_robot.navigation.costmap.core import CostmapCore
from pipros_robot.navigation.costmap.inflation_layer import InflationLayer
from pipros_robot.navigation.costmap.layered import Layer
from pipros_robot.navigation.costmap.observations import ObservationSource, SourceSettings
from pipros_robot.navigation.costmap.obstacle_layer import ObstacleLayer
from pipros_robot.navigation.costmap.sensor_input import DATA_TYPES, SensorInput
from pipros_robot.navigation.costmap.static_layer import StaticLayer, StaticSettings
from pipros_robot.navigation.costmap.voxel_layer import VoxelLayer
from pipros_robot.navigation.limits import NavigationLimits

STATIC, OBSTACLE = "costmap_2d::StaticLayer", "costmap_2d::ObstacleLayer"
VOXEL, INFLATION = "costmap_2d::VoxelLayer", "costmap_2d::InflationLayer"
_ENABLED: Final = Setting("enabled", True, description="Whether the layer is used")
_METHODS: Final = (
    "{'enum_description': 'How costs are combined with those of earlier layers', 'enum': ["
    "{'name': 'Overwrite', 'type': 'int', 'value': 0, 'description': 'Replace them'}, "
    "{'name': 'Maximum', 'type': 'int', 'value': 1, 'description': 'Take the greater one'}, "
    "{'name': 'Nothing', 'type': 'int', 'value': 99, 'description': 'Keep them'}]}"
)
_COMBINATION: Final = "combination_method", 1
_OBSTACLES: Final = (
    _ENABLED,
    Setting("footprint_clearing_enabled", True, description="Whether to free the cells under the robot"),
    Setting("max_obstacle_height", 2.0, 0, 50, "Height above which points do not mark, in metres"),
)
SETTINGS: Final[dict[str, tuple[Setting, ...]]] = {
    STATIC: (_ENABLED,),
    OBSTACLE: (*_OBSTACLES, Setting(*_COMBINATION, None, None, "How costs are combined", 0, _METHODS)),
    VOXEL: (
        *_OBSTACLES,
        Setting("origin_z", 0.0, 0, None, "Height of the lowest voxel, in metres"),
        Setting("z_resolution", 0.2, 0, 50, "Height of a voxel, in metres"),
        Setting("z_voxels", 10, 0, 16, "Number of voxels in a column"),
        Setting("unknown_threshold", 15, 0, 16, "Maximum number of unknown voxels in a known column"),
        Setting("mark_threshold", 0, 0, 16, "Maximum number of marked voxels in a free column"),
        Setting(*_COMBINATION, 0, 2, "How costs are combined", 0, _METHODS),
    ),
    INFLATION: (
        _ENABLED,
        Setting("cost_scaling_factor", 10.0, 0, 100, "How fast costs decrease with the distance, in 1/m"),
        Setting("inflation_radius", 0.55, 0, 50, "Distance from obstacles up to which costs are raised, m"),
        Setting("inflate_unknown", False, description="Whether to raise the costs of unknown cells"),
    ),
}
"""The settings of each type of layer that clients can change."""


ENTRY_POINTS: Final = "pipros.costmap_layers"
_LONGEST_S: Final = 1e9


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
        layers, left_out = _listed_layers(costmap, given)
    else:
        costmap.warn("plugins is not set: the layers are determined by deprecated parameters")
        layers, left_out = _old_layers(costmap, given), []
    inputs: list[SensorInput] = []
    sees = False
    for name, kind in layers:
        count = len(costmap.layered.layers)
        inputs += LAYERS[kind](costmap, name, kind) if kind in LAYERS else _add_own(costmap, name, kind)
        if len(costmap.layered.layers) == count:
            left_out.append(name)
        sees |= bool(inputs) or (kind not in LAYERS and name not in left_out)
    costmap.blind_without = [] if sees else left_out
    return inputs


def _listed_layers(costmap: CostmapCore, given: PrivateParameters) -> tuple[list[tuple[str, str]], list[str]]:
    """Return names and types of the layers to use, and the names of those that are left out."""
    for name in ("static_map", "map_type"):
        if given.has(name):
            costmap.warn("%s has no effect, because plugins is set", name)
    layers, listed, plugins = [], given.values["plugins"], f"{costmap.namespace}/plugins"
    left_out = []
    entries = listed if isinstance(listed, list) else [listed]
    is_strict = read_parameters(costmap.node, "~").boolean("strict", False)
    for each in entries:
        problem = _problem_of(each)
        kind = each["type"] if not problem else "" if is_strict else _seeing_kind(costmap, each)
        if kind:
            if problem:
                costmap.log.warning(
                    "%s: %s; %s runs instead, as it has observation_sources", plugins, problem, kind
                )
            layers.append((each["name"], kind))
            shared = _SHARED.get(kind, ())
            _hand_down(costmap, given, each["name"], shared, kept=shared)
        elif is_strict:
            raise InvalidParameter(f"{plugins}: {problem}, and strict is set")
        else:
            left_out.append(str(each.get("name", each) if isinstance(each, dict) else each)[:200])
            costmap.log.error(
                "%s: %s: the layer is left out, and the robot does not see it", plugins, problem
            )
    if entries and not layers:
        raise InvalidParameter(f"{plugins} has no layer that pipros can use, got {str(listed)[:200]}")
    return layers, left_out


def _seeing_kind(costmap: CostmapCore, entry: Any) -> str:
    """Return the type of layer to use for an unknown one that has observation sources; empty if it has none.

    Such layers are derived from ObstacleLayer or VoxelLayer.
    """
    if not (isinstance(entry, dict) and all(isinstance(entry.get(key), str) for key in ("name", "type"))):
        return ""
    given = read_parameters(costmap.node, f"{costmap.namespace}/{entry['name']}")
    if not _source_names(given, entry["name"]):
        return ""
    is_voxel = "Voxel" in entry["type"] or any(map(given.has, ("origin_z", "z_resolution", "z_voxels")))
    return VOXEL if is_voxel else OBSTACLE


def _source_names(given: PrivateParameters, place: str) -> list[str]:
    """Return the names of a layer's observation sources.

    Raises:
        InvalidParameter: they are not a text, so that genuine costmap_2d does not see anything.
    """
    found = given.values.get("observation_sources", "")
    if not isinstance(found, str):
        text = "must be a text with names, separated by spaces"
        raise InvalidParameter(f"{place}/observation_sources {text}, got {str(found)[:200]}")
    return found.split()


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
                f"it must be a pipros_robot.navigation.costmap.layered.Layer, got {type(layer).__name__}"
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
    sources = dict.fromkeys(_source_names(given, costmap.namespace))
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
    names = _source_names(given, namespace)
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
    values = PrivateParameters({**given.values, **found}, f"{namespace}/")
    frame = given.text("sensor_frame", "").lstrip("/")
    endless = ("min_obstacle_height", "max_obstacle_height", "obstacle_range", "raytrace_range")
    settings = values.read(SourceSettings, endless, topic=given.text("topic", name), sensor_frame=frame)
    for name in ("observation_persistence", "expected_update_rate"):
        if not 0 <= (value := getattr(settings, name)) < _LONGEST_S:
            raise InvalidParameter(f"{namespace}/{name} must be from 0 to {_LONGEST_S:g} s, got {value:g}")
    if settings.data_type not in DATA_TYPES:
        expected = f"one of {', '.join(DATA_TYPES)}"
        raise InvalidParameter(f"{namespace}/data_type must be {expected}, got {settings.data_type}")
    return settings
