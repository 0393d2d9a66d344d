"""Displays, with and without errors, whose status texts must be equal in genuine rviz and the Scene tab.

`script/generate rviz statuses` records the texts of genuine rviz in `rviz_statuses.json`.
`scene_program.py` and `bad_scene_program.py` in `tests.browser.programs` publish the messages.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from pipros_page.scene.layout_file import read_rviz, write_rviz
from tests.support.rviz_scenes import SCENES, config_of, display

LEVELS = ("ok", "warning", "error")
Statuses = dict[str, dict[str, tuple[str, str]]]
"""The level and text of each status, by display and by name of the status."""

BAD = {
    "Path": "path", "Pose": "pose", "PoseArray": "poses", "Odometry": "odom",
    "PoseWithCovariance": "covariance", "Polygon": "polygon", "PointStamped": "point",
    "WrenchStamped": "wrench",
}  # fmt: skip
DISPLAYS: Mapping[str, str] = {
    **{f"bad {kind}": display(kind, Topic=f"/bad/{topic}") for kind, topic in BAD.items()},
    "zero quaternion": display("Pose", Topic="/bad/zero"),
    "bad markers": display("MarkerArray", Marker_Topic="/bad/markers"),
    "wrong update topic": display("InteractiveMarkers", Update_Topic="/a"),
    "silent map": display("Map", Topic="/silent_map"),
    "silent image": display("Image", Image_Topic="/silent_image"),
    "silent camera": display("Camera", Image_Topic="/silent_camera"),
    "silent markers": display("MarkerArray", Marker_Topic="/silent_markers"),
    "silent controls": display("InteractiveMarkers", Update_Topic="/silent/update"),
    "no robot": display("RobotModel", Robot_Description="nothing"),
    "empty robot": display("RobotModel", Robot_Description="empty_robot"),
    "axes of an unknown frame": display("Axes", Reference_Frame="nowhere"),
    "grid of an unknown frame": display("Grid", Reference_Frame="nowhere"),
    "image": display("Image", Image_Topic="/picture"),
    "camera": display("Camera", Image_Topic="/camera/image"),
    "camera without its info": display("Camera", Image_Topic="/picture"),
}


def statuses_file() -> str:
    """Return the text of an `.rviz` file with the displays in `DISPLAYS` and one for each different scene."""
    config: dict[str, Any] = read_rviz(config_of("grid"))
    shown = config["Visualization Manager"]["Displays"]
    shown.clear()
    for name, (_, text) in SCENES.items():
        if text not in (other for _, other in list(SCENES.values())[: list(SCENES).index(name)]):
            shown.append(_named(name, text))
    shown += [_named(name, text) for name, text in DISPLAYS.items()]
    return write_rviz(config)


def _named(name: str, text: str) -> dict[str, Any]:
    made: dict[str, Any] = read_rviz(f"Visualization Manager:\n  Displays: [{text}]\n")
    return {**made["Visualization Manager"]["Displays"][0], "Name": name}


NOT_COMPARED = frozenset({"Points", "Time"})
"""Statuses that rviz leaves empty, or uses for its panel Time."""
SENDER = re.compile(r"\[sender=.*\]")


def statuses_of(lines: Iterable[str]) -> Statuses:
    """Return the final statuses, given the lines that the library rviz_statuses.c wrote."""
    found: Statuses = {}
    for line in lines:
        what, name, *more = line.rstrip("\n").split("\t")
        own = found.setdefault(name, {})
        if what == "clear":
            own.clear()
        elif what == "delete":
            own.pop(more[0], None)
        else:
            own[more[1]] = LEVELS[int(more[0])], more[2]
    return {name: own for name, own in found.items() if name}


def comparable(statuses: Mapping[str, tuple[str, str]]) -> dict[str, tuple[str, str]]:
    """Return the statuses that can be compared, without numbers and senders, which rviz does not know."""
    return {
        SENDER.sub("[sender]", name): (level, re.sub(r"\d+", "#", text))
        for name, (level, text) in statuses.items()
        if name not in NOT_COMPARED
    }
