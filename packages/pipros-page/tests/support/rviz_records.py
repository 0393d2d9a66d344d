"""Mouse actions, panels and statuses that must be alike in genuine rviz and in the Scene tab.

`script/generate rviz controls` performs the actions on interactive markers in genuine rviz, and records the
feedback in `rviz_controls.json`; `tests.browser.programs.controls_program` creates the markers. `panels`
records the colours of images and cameras in `rviz_panels.json`, at those pixels of the image whose
surroundings have a single colour, and `statuses` the status texts of displays, with and without errors, in
`rviz_statuses.json`; `scene_program` and `bad_scene_program` publish the messages.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pipros_page.scene.layout_file import read_rviz, write_rviz
from tests.support.rviz_scenes import (
    HEIGHT,
    ORTHO,
    ROBOT,
    SCENES,
    SHAPES,
    TEMPLATE,
    WIDTH,
    config_of,
    display,
)

SCALE = 50
KEEP_ALIVE, POSE_UPDATE = 0, 1
DIGITS = 3
ROUNDED = ("position", "orientation", "mouse_point")


@dataclass(frozen=True, slots=True)
class Grip:
    """A click on a marker, or a drag.

    Attributes:
        at: the position at which the button is pressed, in metres from the middle of the picture.
        by: the distance of the drag, in metres.
        button: the number of the mouse button; 1 is the left button.
        key: the key that is held down; empty for none.
        menu_entry: the entry chosen in the menu; empty if no menu opens.
    """

    marker: str
    at: tuple[float, float]
    by: tuple[float, float] = (0.0, 0.0)
    button: int = 1
    key: str = ""
    menu_entry: str = ""

    def pixels(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Return the pixels at which the button is pressed and released, from the upper left corner."""
        end = self.at[0] + self.by[0], self.at[1] + self.by[1]
        first, last = (
            (round(WIDTH / 2 + x * SCALE), round(HEIGHT / 2 - y * SCALE)) for x, y in (self.at, end)
        )
        return first, last


GRIPS: Sequence[Grip] = (
    Grip("move_axis", (-4.6, 4.0), (0.8, 0.3)), Grip("move_plane", (-0.86, 4.0), (0.5, -0.6)),
    Grip("rotate_axis", (3.14, 4.0), (-0.8, 0.8)), Grip("move_rotate", (7.14, 4.0), (0.3, 0.9)),
    Grip("move_3d", (-5.8, 0.2), (0.6, 0.4)), Grip("move_3d_deep", (-3.8, 0.2), (0.0, 0.6), key="Shift"),
    Grip("rotate_3d", (-1.8, 0.2), (0.4, 0.2)),
    Grip("move_rotate_3d", (0.2, 0.2), (0.3, -0.4), key="Control"), Grip("button", (2.2, 0.2)),
    Grip("menu", (4.2, 0.2), button=3, menu_entry="First"),
    Grip("menu_left", (6.2, 0.2), menu_entry="Second"), Grip("facing", (-5.8, -3.8), (0.5, 0.3)),
    Grip("stamped", (-3.8, -3.8), (0.4, 0.7)), Grip("locked", (-1.8, -3.8), (0.4, 0.7)),
    Grip("fixed", (1.14, -4.0), (-0.5, 0.9)),
)  # fmt: skip


def controls_file() -> str:
    """Return the `.rviz` file that shows the markers."""
    shown = display("InteractiveMarkers", Update_Topic="/controls/update")
    return TEMPLATE.format(displays=shown, view=ORTHO).replace("rviz/MoveCamera", "rviz/Interact")


def feedback_by_marker(lines: Sequence[Mapping[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Group feedback by marker, with rounded values and without keep-alives.

    rviz reports the pose with each picture. Therefore, updates without a mouse point are also dropped if they
    repeat the previous pose.
    """
    found: dict[str, list[dict[str, Any]]] = {}
    for line in lines:
        if line["event_type"] == KEEP_ALIVE:
            continue
        rounded = {name: [round(value, DIGITS) + 0.0 for value in line[name]] for name in ROUNDED}
        made = {**line, **rounded, "client_id": line["client_id"].rpartition("/")[2]}
        events = found.setdefault(line["marker_name"], [])
        is_new = not events or any(made[name] != events[-1][name] for name in ("position", "orientation"))
        if is_new or made["mouse_point_valid"] or made["event_type"] != POSE_UPDATE:
            events.append(made)
    return found


SIZES: Mapping[str, tuple[int, int]] = {"Image": (40, 30), "Camera": (160, 160)}
"""The width and height of the images in pixels, by the class of the display."""
STEP = 5
Colour = tuple[int, int, int]


def image(topic: str, **properties: object) -> str:
    return display("Image", Image_Topic=topic, **properties)


def camera(rendering: str, **properties: object) -> str:
    shown = display("Camera", Image_Topic="/wide/image", Image_Rendering=rendering, **properties)
    group = f"{{Class: rviz/Group, Name: G, Enabled: true, Displays: [{ROBOT}]}}"
    return f"{SHAPES}, {group}, {shown}"


PANELS: Mapping[str, str] = {
    "colours": image("/picture"), "depths": image("/picture_16"),
    "depths_within": image("/picture_16", Normalize_Range="false", Min_Value=1000, Max_Value=3000),
    "floats": image("/picture_32"),
    "floats_within": image("/picture_32", Normalize_Range="false", Min_Value=0, Max_Value=4),
    "camera": camera("background and overlay"), "camera_behind": camera("background"),
    "camera_over": camera("overlay", Overlay_Alpha=0.25),
    "camera_zoomed": camera("background and overlay", Zoom_Factor=2),
    "camera_without": camera("background and overlay",
        Visibility="{MarkerArray: false, G: {RobotModel: true, Value: true}}"),
    "camera_without_group": camera("background and overlay",
        Visibility="{MarkerArray: true, G: {RobotModel: false, Value: true}}"),
}  # fmt: skip


def display_of(name: str) -> str:
    """Return the class of the display to which a panel belongs."""
    return "Camera" if name.startswith("camera") else "Image"


def panel_file(name: str) -> str:
    """Return the text of the `.rviz` file for a panel."""
    return TEMPLATE.format(displays=PANELS[name], view=ORTHO)


def probes_of(rgb: bytes, size: tuple[int, int], image_size: tuple[int, int]) -> dict[str, Sequence[int]]:
    """Return the colours of those pixels of an image whose surroundings have a single colour.

    Args:
        rgb: the picture of the panel, in which the image is scaled.
        size: the size of the panel.
        image_size: the size of the image.

    Returns:
        Colours by the pixel's `column,row` in the image.
    """
    scale = min(size[0] / image_size[0], size[1] / image_size[1])
    edge = [(whole - part * scale) / 2 for whole, part in zip(size, image_size, strict=True)]
    found: dict[str, Sequence[int]] = {}
    for row in range(STEP // 2, image_size[1], STEP):
        for column in range(STEP // 2, image_size[0], STEP):
            x, y = edge[0] + (column + 0.5) * scale, edge[1] + (row + 0.5) * scale
            reach = 1.6 * scale
            around = {
                _pixel(rgb, size[0], int(x + dx * reach), int(y + dy * reach))
                for dx in (-1, 0, 1)
                for dy in (-1, 0, 1)
                if 0 <= x + dx * reach < size[0] and 0 <= y + dy * reach < size[1]
            }
            if len(around) == 1:
                found[f"{column},{row}"] = list(around.pop())
    return found


def _pixel(rgb: bytes, width: int, x: int, y: int) -> Colour:
    at = (y * width + x) * 3
    return rgb[at], rgb[at + 1], rgb[at + 2]


LEVELS = ("ok", "warning", "error")
Statuses = dict[str, dict[str, tuple[str, str]]]
"""The level and text of each status, by display and by name of the status."""

BAD = {
    "Path": "path", "Pose": "pose", "PoseArray": "poses", "Odometry": "odom",
    "PoseWithCovariance": "covariance", "Polygon": "polygon", "PointStamped": "point",
    "WrenchStamped": "wrench", "Temperature": "temperature",
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
