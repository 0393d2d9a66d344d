"""Look up nodelets by name: Python nodelets, and C++ plugins installed on this machine.

`PLUGINS` lists pipros's nodelets. Other distributions add nodelets through entry points in the group
`pipros.nodelets`, whose names are plugin names (`my_package/MyNodelet`) and whose values name classes.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.metadata import entry_points
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.packages.system_packages import manifest_folders
from pipros.safe import xml
from pipros.safe.tolerant_xml import strict_text

_KIND = "nodelets"
ENTRY_POINTS: Final = f"pipros.{_KIND}"

CHOICE_VARIABLE: Final = "PIPROS_NODELETS"
"""Environment variable that selects the implementation of a manager's nodelets."""

OURS: Final = "ours"
GENUINE: Final = "genuine"

PLUGINS: Final[Mapping[str, str]] = {
    "depth_image_proc/convert_metric": "images.depth_nodelets:ConvertMetric",
    "depth_image_proc/point_cloud_xyz": "images.depth_nodelets:PointCloudXyz",
    "depth_image_proc/point_cloud_xyzrgb": "images.depth_nodelets:PointCloudXyzrgb",
    "depth_image_proc/register": "images.depth_nodelets:Register",
    "depthimage_to_laserscan/DepthImageToLaserScanNodelet": "laser.depth_to_scan_node:DepthToScanNode",
    "image_proc/debayer": "images.debayer:Debayer",
    "image_proc/rectify": "images.rectify:Rectify",
    "imu_filter_madgwick/ImuFilterNodelet": "imu.nodes:MadgwickNode",
    "kobuki_safety_controller/SafetyControllerNodelet": "teleoperation.safety_controller_node:SafetyNode",
    "laser_filters/scan_to_cloud_filter_chain": "laser.chain_node:ScanToCloudFilterChain",
    "laser_filters/scan_to_scan_filter_chain": "laser.chain_node:ScanToScanFilterChain",
    "pcl/CropBox": "clouds.filter_nodes:CropBox",
    "pcl/EuclideanClusterExtraction": "clouds.segmentation_nodes:EuclideanClusterExtraction",
    "pcl/ExtractIndices": "clouds.filter_nodes:ExtractIndices",
    "pcl/PassThrough": "clouds.filter_nodes:PassThrough",
    "pcl/SACSegmentation": "clouds.segmentation_nodes:SacSegmentation",
    "pcl/StatisticalOutlierRemoval": "clouds.filter_nodes:StatisticalOutlierRemoval",
    "pcl/VoxelGrid": "clouds.filter_nodes:VoxelGrid",
    "pointcloud_to_laserscan/pointcloud_to_laserscan_nodelet": "laser.cloud_to_scan_node:CloudToScanNode",
    "stereo_image_proc/disparity": "images.disparity:Disparity",
    "stereo_image_proc/point_cloud2": "images.stereo_cloud:StereoCloud",
    "yocs_cmd_vel_mux/CmdVelMuxNodelet": "teleoperation.cmd_vel_mux_node:CmdVelMuxNode",
    "yocs_velocity_smoother/VelocitySmootherNodelet": "teleoperation.velocity_smoother_node:SmootherNode",
}
"""pipros's nodelets. Their modules are relative to `pipros.libraries`."""

_PACKAGE_OF_PREFIX = {"jsk_pcl": "jsk_pcl_ros", "jsk_pcl_utils": "jsk_pcl_ros_utils", "pcl": "pcl_ros"}
"""Packages by prefix of plugin names, for prefixes that are not package names."""


class InvalidChoice(PiprosError, ValueError):
    """`PIPROS_NODELETS` has an unknown value."""


def chosen(variables: Mapping[str, str] = os.environ) -> str:
    """Return the implementation that `PIPROS_NODELETS` selects; empty if it is unset.

    Raises:
        InvalidChoice: the value is neither `ours` nor `genuine`.
    """
    value = variables.get(CHOICE_VARIABLE, "")
    if value not in ("", OURS, GENUINE):
        raise InvalidChoice(f"{CHOICE_VARIABLE} must be {OURS} or {GENUINE}, got [{value}]")
    return value


def python_nodelet(plugin: str) -> str | None:
    """Return the class of a Python nodelet as `module:name`, or None if no Python nodelet has this name."""
    if plugin in PLUGINS:
        return f"pipros.libraries.{PLUGINS[plugin]}"
    return _of_others().get(plugin)


@cache
def _of_others() -> Mapping[str, str]:
    return {point.name: point.value for point in entry_points(group=ENTRY_POINTS)}


def package_of(plugin: str) -> str:
    """Return the package that the prefix of a plugin's name denotes: `pcl_ros` for `pcl/VoxelGrid`."""
    prefix = plugin.partition("/")[0]
    return _PACKAGE_OF_PREFIX.get(prefix, prefix)


def compiled_nodelets(folders: Iterable[str] = ()) -> dict[str, str]:
    """Map the plugin names of the C++ nodelets described on this machine to their packages.

    Unreadable descriptions are skipped.

    Args:
        folders: package folders to search before those of the system.
    """
    found: dict[str, str] = {}
    for folder in (*folders, *manifest_folders()):
        for description in _descriptions(folder):
            for name in _names(description):
                found.setdefault(name, os.path.basename(folder))
    return found


def _root(path: str) -> xml.Element | None:
    try:
        # A description may have several roots.
        return xml.parse(f"<all>{strict_text(read_text(path))}</all>", path)
    except (PiprosError, OSError):
        return None


def _descriptions(folder: str) -> Iterator[str]:
    manifest = _root(os.path.join(folder, "package.xml"))
    package = manifest.first("package") if manifest else None
    for export in package.all("export") if package else ():
        for each in export.all("nodelet"):
            if plugin := each.attributes.get("plugin"):
                yield plugin.replace("${prefix}", folder)


def _names(description: str) -> Iterator[str]:
    root = _root(description)
    libraries = [] if root is None else [*root.all("library")]
    for group in root.all("class_libraries") if root else ():
        libraries += group.all("library")
    for library in libraries:
        for each in library.all("class"):
            yield each.attributes.get("name") or each.attributes.get("type", "")
