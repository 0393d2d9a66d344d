"""The programs `image_proc` and `stereo_image_proc`, which run several nodelets in one node."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Mapping, Sequence
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.nodelets.hosting import CannotLoad, Hosting

FAILED: Final = 255
CHECK_S: Final = 60.0
"""Interval between warnings about inputs that are not published."""

_PER_CAMERA: Final[Sequence[tuple[str, str, Mapping[str, str]]]] = (
    ("debayer", "image_proc/debayer", {}),
    ("rectify_mono", "image_proc/rectify", {}),
    ("rectify_color", "image_proc/rectify", {"image_mono": "image_color", "image_rect": "image_rect_color"}),
)
"""Name, plugin and remappings of the nodelets for one camera."""


@exits_after_ctrl_c()
def image_proc(argv: Sequence[str] | None = None) -> int:
    """Run `image_proc` until the node is shut down. Return the exit code."""
    with roscpp_program("image_proc", "image_proc", argv) as (node, log):
        _check_namespace(node, log)
        nodelets = [
            (f"_{name}", plugin, {**remappings}, {"queue_size"}) for name, plugin, remappings in _PER_CAMERA
        ]
        return _run(node, log, nodelets, ["image_raw", "camera_info"])


@exits_after_ctrl_c()
def stereo_image_proc(argv: Sequence[str] | None = None) -> int:
    """Run `stereo_image_proc` until the node is shut down. Return the exit code."""
    with roscpp_program("stereo_image_proc", "stereo_image_proc", argv) as (node, log):
        _check_namespace(node, log)
        nodelets: list[tuple[str, str, dict[str, str], set[str]]] = []
        for side in ("left", "right"):
            for name, plugin, remappings in _PER_CAMERA:
                topics = ["image_raw", "camera_info", "image_mono", "image_color", "image_rect"]
                moved = {each: f"{side}/{remappings.get(each, each)}" for each in topics}
                nodelets.append((f"_{name}_{side}", plugin, moved, {"queue_size"}))
        shared = {"queue_size", "approximate_sync", "downsampling_factor"}
        nodelets.append(("", "stereo_image_proc/disparity", {}, set()))
        nodelets.append(("_point_cloud2", "stereo_image_proc/point_cloud2", {}, shared))
        inputs = [f"{side}/{topic}" for side in ("left", "right") for topic in ("image_raw", "camera_info")]
        return _run(node, log, nodelets, inputs)


def _check_namespace(node: Node, log: logging.Logger) -> None:
    if node.namespace == "/":
        log.warning("started in the global namespace; start in the namespace of the camera (__ns:=camera)")
    if node.resolve("camera") != f"{node.namespace}camera":
        log.warning("remapping [camera] has no effect; start in the namespace of the camera (__ns:=camera)")


def _run(
    node: Node,
    log: logging.Logger,
    nodelets: Sequence[tuple[str, str, Mapping[str, str], set[str]]],
    inputs: Sequence[str],
) -> int:
    """Load nodelets, and run until the node is shut down. Return the exit code.

    Inputs without publishers cause warnings until all inputs have been advertised.

    Args:
        nodelets: for each nodelet, the suffix to append to the node's name, the plugin, the remappings, and
            the node's private parameters to copy to the nodelet.
    """
    hosting = Hosting(node)
    for suffix, plugin, remappings, parameters in nodelets:
        name = f"{node.name}{suffix}"
        for parameter in parameters:
            with contextlib.suppress(LookupError):
                node.params.set(f"{name}/{parameter}", node.params.get(f"~{parameter}"))
        resolved = {node.namespace + source: node.resolve(target) for source, target in remappings.items()}
        try:
            hosting.load(name, plugin, remappings=resolved)
        except CannotLoad as error:
            log.critical("%s", error)
            return FAILED
    missing = {node.resolve(each) for each in inputs}
    while missing:
        try:
            missing -= {topic for topic, _ in node.master.get_published_topics()}
        except PiprosError as error:
            log.warning("cannot ask the master for topics: %s", error)
        for topic in sorted(missing):
            log.warning("The input topic '%s' is not yet advertised", topic)
        if node.wait_for_shutdown(CHECK_S):
            return 0
    node.wait_for_shutdown()
    return 0
