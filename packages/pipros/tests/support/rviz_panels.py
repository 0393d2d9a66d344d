"""Panels of images and cameras, which must look the same in genuine rviz and in the Scene tab.

`script/generate rviz panels` records colours from genuine rviz in `rviz_panels.json`, at those
pixels of the image whose surroundings have a single colour. `tests.browser.programs.scene_program`
publishes the messages.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tests.support.rviz_scenes import ORTHO, ROBOT, SHAPES, TEMPLATE, display

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
    "colours": image("/picture"),
    "depths": image("/picture_16"),
    "depths_within": image("/picture_16", Normalize_Range="false", Min_Value=1000, Max_Value=3000),
    "floats": image("/picture_32"),
    "floats_within": image("/picture_32", Normalize_Range="false", Min_Value=0, Max_Value=4),
    "camera": camera("background and overlay"),
    "camera_behind": camera("background"),
    "camera_over": camera("overlay", Overlay_Alpha=0.25),
    "camera_zoomed": camera("background and overlay", Zoom_Factor=2),
    "camera_without": camera(
        "background and overlay", Visibility="{MarkerArray: false, G: {RobotModel: true, Value: true}}"
    ),
    "camera_without_group": camera(
        "background and overlay", Visibility="{MarkerArray: true, G: {RobotModel: false, Value: true}}"
    ),
}


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
