"""The topics that the nodes of a launch file read and write, from their types, parameters and remappings."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.words import split_words
from pipros.packages import shipped_folder
from pipros.packages.nodelets import package_of
from pipros.safe import yaml
from pipros.safe.xml import Element
from pipros_tools.launch.model import Launch, LaunchNode
from pipros_tools.launch.nodelet_choice import arguments_of
from pipros_workspace.manifest import read_manifest

_KINDS: Final = {
    "geometry_msgs/Twist": "cmd_vel",
    "nav_msgs/Odometry": "odom",
    "sensor_msgs/Image": "depth image",
    "sensor_msgs/Imu": "imu",
    "sensor_msgs/JointState": "joints",
    "sensor_msgs/LaserScan": "scan",
    "sensor_msgs/PointCloud2": "cloud",
}
"""Kinds of data by type of message."""
_TRUE_POSE: Final = "base_pose_ground_truth"

FILTERS: Final = ("robot_localization/ekf_localization_node", "robot_localization/ukf_localization_node")
_FILTER_INPUT = re.compile(r"(odom|imu)\d+")
_SOURCE_KINDS = {"LaserScan": "scan", "PointCloud2": "cloud", "PointCloud": "cloud"}


class SensorTopic(NamedTuple):
    """An observation source of a costmap."""

    topic: str
    kind: str
    frame: str
    min_height: float
    max_height: float


@dataclass(frozen=True)
class NodeView:
    """A node of a launch file with its parameters.

    Attributes:
        kind: `package/program`, or the nodelet's type.
        params: its private parameters by their names relative to the node, such as `global_costmap/width`.
    """

    node: LaunchNode
    params: Mapping[str, Any]
    kind: str = field(init=False)

    def __post_init__(self) -> None:
        nodelet = arguments_of(self.node)
        plugin = nodelet.plugin if nodelet else ""
        object.__setattr__(self, "kind", plugin or f"{self.node.package}/{self.node.type}")

    @property
    def is_known(self) -> bool:
        return _declaration(self.kind) is not None

    def topic(self, name: str) -> str:
        """Return the full name of a topic, after remapping."""
        full = self.node.full_name
        return names.resolve(name, full, names.resolve_remappings(dict(self.node.remappings), full))

    def words(self) -> list[str]:
        """Return the arguments without options and remappings."""
        try:
            words = split_words(self.node.arguments)
        except ValueError:  # the error is reported when the node is started
            return []
        return [word for word in words if not word.startswith("--") and ":=" not in word]

    def frame(self, param: str, default: str) -> str:
        """Return a frame from a parameter, without a leading slash."""
        return str(self.params.get(param, default)).lstrip("/")

    def reads(self) -> Iterator[tuple[str, str]]:
        """Yield the kind and the full name of each topic that the node reads."""
        yield from self._declared("subscribes")
        if self.kind in FILTERS:
            for key, value in self.params.items():
                if found := _FILTER_INPUT.fullmatch(key):
                    yield found[1], self.topic(str(value))
        elif self.kind == "twist_mux/twist_mux":
            yield from (("cmd_vel", topic) for topic in self._inputs(self.params.get("topics")))
        elif self.kind == "yocs_cmd_vel_mux/CmdVelMuxNodelet":
            yield from (("cmd_vel", topic) for topic in self._inputs(self._configured("subscribers"), "~"))
        elif self.kind == "move_base/move_base":
            yield from ((source.kind, source.topic) for source in self.sources())
        elif self.kind == "topic_tools/relay" and len(self.words()) == 2:
            yield "any", self.topic(self.words()[0])

    def writes(self) -> Iterator[tuple[str, str]]:
        """Yield the kind and the full name of each topic that the node writes."""
        yield from self._declared("publishes")
        if self.kind == "topic_tools/relay" and len(self.words()) == 2:
            yield "any", self.topic(self.words()[1])
        elif self.kind == "yocs_cmd_vel_mux/CmdVelMuxNodelet":
            yield "cmd_vel", self.topic(names.join("~", str(self._configured("publisher") or "output")))

    def _declared(self, tag: str) -> Iterator[tuple[str, str]]:
        """Yield the kind and the full name of each topic in a list of the node's declaration."""
        declaration = _declaration(self.kind)
        for each in declaration.all(tag) if declaration is not None else ():
            name = each.attributes["topic"]
            kind = "true pose" if name == _TRUE_POSE else _KINDS[each.attributes["type"]]
            yield kind, self.topic(str(self.params.get(each.attributes.get("param", ""), name)))

    def _inputs(self, given: object, namespace: str = "") -> Iterator[str]:
        """Yield the input topics of a multiplexer, which are in a list of mappings."""
        for each in given if isinstance(given, list) else []:
            if isinstance(each, dict) and isinstance(each.get("topic"), str):
                yield self.topic(names.join(namespace, each["topic"]))

    def _configured(self, key: str) -> object:
        """Return a value in the file that the parameter `yaml_cfg_file` names, or None."""
        try:
            found = yaml.load(read_text(str(self.params.get("yaml_cfg_file", ""))))
        except (OSError, PiprosError, UnicodeDecodeError):  # the nodelet reports it
            return None
        return found.get(key) if isinstance(found, dict) else None

    def sources(self) -> Iterator[SensorTopic]:
        """Yield the observation sources of all costmaps, also where costmap_2d searches for them."""
        for key, value in self.params.items():
            if key.rpartition("/")[2] != "observation_sources" or not isinstance(value, str):
                continue
            for name in value.split():
                below = key.removesuffix("observation_sources") + name
                yield SensorTopic(
                    self.topic(str(self.params.get(f"{below}/topic", name))),
                    _SOURCE_KINDS.get(str(self.params.get(f"{below}/data_type", "PointCloud")), "other"),
                    self.frame(f"{below}/sensor_frame", ""),
                    _number(self.params.get(f"{below}/min_obstacle_height"), 0.0),
                    _number(self.params.get(f"{below}/max_obstacle_height"), 2.0),
                )


@cache
def _declaration(kind: str) -> Element | None:
    """Return the `<pipros node="…">` of a program or nodelet in its package.xml, or None.

    Packages that pipros and its plugins ship declare there the topics of data from and for robots.
    """
    folder, name = shipped_folder(package_of(kind)), kind.partition("/")[2]
    exports = read_manifest(Path(folder)).exports if folder else ()
    declared = (each for each in exports if each.tag == "pipros" and each.attributes.get("node") == name)
    return next(declared, None)


def views_of(launch: Launch) -> list[NodeView]:
    """Return the nodes of a launch file."""
    return [NodeView(node, params_below(launch, node.full_name + "/")) for node in launch.nodes]


def params_below(launch: Launch, prefix: str) -> dict[str, Any]:
    """Return the parameters in a namespace by their names relative to it."""
    return {key.removeprefix(prefix): value for key, value in launch.params.items() if key.startswith(prefix)}


def _number(value: object, default: float) -> float:
    return float(value) if isinstance(value, int | float) else default
