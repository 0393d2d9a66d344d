"""Mouse actions on interactive markers, for genuine rviz and for the Scene tab.

`script/generate rviz controls` performs them in genuine rviz, and records the feedback in
`rviz_controls.json`. `tests.browser.programs.controls_program` creates the markers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tests.support.rviz_scenes import HEIGHT, ORTHO, TEMPLATE, WIDTH, display

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
