"""Scenes that genuine rviz and the Scene tab must draw alike, and records of rviz's pictures.

`script/generate rviz` draws the scenes with genuine rviz, and writes the records to tests.golden.rviz. A
record contains the colours of pixels in a grid, at least three pixels away from any edge, and the
silhouette: the pixels that differ from the background.
"""

import base64
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

WIDTH, HEIGHT = 868, 608
"""Size of rviz's picture in pixels, in a window of 900 by 700 pixels without docks."""

BACKGROUND = (48, 48, 48)
FULL_COLOUR = 100
"""Difference of the channels of a pixel that no grey map covers, not even one that is seen through."""
EDGE = 3
STEP = 8
ORTHO = "{Class: rviz/TopDownOrtho, Name: Current View, Scale: 50, X: 0, Y: 0, Angle: 0}"
ORBIT = (
    "{Class: rviz/Orbit, Name: Current View, Distance: 12, Yaw: 5.2, Pitch: 0.9, Near Clip Distance: 0.01, "
    "Focal Point: {X: 0, Y: 0, Z: 0}}"
)
FPS = "{Class: rviz/FPS, Name: Current View, Yaw: 0.6, Pitch: 0.5, Roll: 0, Position: {X: -8, Y: -6, Z: 7}}"
TEMPLATE = """\
Panels: []
Visualization Manager:
  Class: ""
  Displays: [{displays}]
  Enabled: true
  Global Options: {{Background Color: 48; 48; 48, Default Light: true, Fixed Frame: map, Frame Rate: 10}}
  Name: root
  Tools:
    - Class: rviz/MoveCamera
  Views:
    Current: {view}
    Saved: ~
Window Geometry: {{Hide Left Dock: true, Hide Right Dock: true, Width: 900, Height: 700, X: 0, Y: 0}}
"""


def display(kind: str, **properties: object) -> str:
    """Return a display in YAML. Underscores in the names of properties stand for spaces."""
    names = {"Size_m": "Size (m)", "Size_px": "Size (Pixels)"}
    more = "".join(
        f", {names.get(name) or name.replace('_', ' ')}: {each}" for name, each in properties.items()
    )
    return f"{{Class: rviz/{kind}, Name: {kind}, Enabled: true, Value: true{more}}}"


# fmt: off
ROBOT = display("RobotModel")
SHAPES = display("MarkerArray", Marker_Topic="/shapes")
OFF_PIXELS = "{X: 0.23, Y: 0.23, Z: 0}"
"""Where the lines of a grid are not between two rows of pixels."""
ON_A_MAP = ", ".join((
    display("Path", Topic="/plan", Color="255; 0; 0", Line_Style="Billboards", Line_Width=0.3),
    display("PoseArray", Topic="/poses", Arrow_Length=2, Color="0; 160; 0"),
    display("Polygon", Topic="/polygon", Color="25; 255; 0"),
    display("Grid", Color="0; 0; 255", Alpha=1, Cell_Size=2, Plane_Cell_Count=4, Offset=OFF_PIXELS),
))
"""A path, a particle cloud, a footprint and a grid, all at the height of the map below them."""


def on_a_map(**properties: object) -> str:
    return f"{ON_A_MAP}, {display('Map', Topic='/floor', **properties)}"


def cloud(topic: str = "/cloud", Size_m: float = 0.6, **more: object) -> str:  # noqa: N803 # names of rviz
    return display("PointCloud2", Topic=topic, Size_m=Size_m, **more)


GRID = display("Grid", Offset=OFF_PIXELS)
SCAN = display("LaserScan", Topic="/scan", Size_m=0.3, Color_Transformer="FlatColor", Color="255; 0; 0")
FLAT = {"Color_Transformer": "FlatColor", "Color": "9; 80; 200"}
DEPTH = {"Depth_Map_Topic": "/depth/image", **FLAT, "Auto_Size": "{Value: false}", "Style": "Points"}
LAYOUTS: Mapping[str, tuple[str, str]] = {
    # A costmap above a map, a global plan, particles, a footprint, the robot with its scan, and the goal.
    "navigation": (ORTHO, ", ".join((
        ROBOT, SCAN, ON_A_MAP, display("Map", Topic="/floor"),
        display("Map", Topic="/map", Color_Scheme="costmap", Alpha=0.5),
        display("Pose", Topic="/pose", Color="0; 0; 255", Shaft_Radius=0.2, Head_Radius=0.4),
    ))),
    # A growing map, the scan, the robot and its odometry, seen from the side.
    "gmapping": (ORBIT, ", ".join((
        GRID, display("Map", Topic="/floor"), SCAN, ROBOT, display("TF", Show_Names="false"),
    ))),
    # The map below everything, with the trajectory as markers, and points above it.
    "cartographer": (ORBIT, ", ".join((
        display("Map", Topic="/floor", Draw_Behind="true"), ROBOT, SHAPES,
        cloud("/rgb_cloud", 0.5, Color_Transformer="FlatColor", Color="0; 255; 0"),
    ))),
    # The robot in its odometry frame with an interactive marker.
    "husky": (ORBIT.replace("Distance: 12", "Distance: 14"), ", ".join((
        GRID, ROBOT, display("Odometry", Topic="/odom", Keep=1, Covariance="{Value: false}"),
        display("InteractiveMarkers", Update_Topic="/controls/update"),
    ))),
    # A local plan with poses along it, the polygon of the footprint, and the obstacles as markers.
    "teb": (ORTHO, ", ".join((
        GRID, display("Path", Topic="/plan", Pose_Style="Arrows", Head_Diameter=0.4),
        display("PoseArray", Topic="/poses", Arrow_Length=1), display("Polygon", Topic="/polygon"),
        display("Marker", Marker_Topic="/visualization_marker"),
    ))),
    # Registered points by height, the trajectory, and the axes of the sensor, on black.
    "lidar_odometry": (ORBIT, ", ".join((
        display("PointCloud2", Topic="/cloud", Style="Points", Size_px=12, Color_Transformer="Intensity"),
        display("Path", Topic="/plan", Line_Style="Billboards", Line_Width=0.2),
        display("Axes", Reference_Frame="turned", Length=2, Radius=0.3),
    ))),
    # The file of a tutorial: a grid and all frames, which the file does not name.
    "turtle_tf": (
        "{Class: rviz/Orbit, Name: Current View, Distance: 14.5, Yaw: 1.57, Pitch: 0.8, "
        "Focal Point: {X: 1, Y: 1, Z: 0}}",
        f"{GRID}, {display('TF', Marker_Scale=5, Show_Names='false', Frames='{All Enabled: false}')}",
    ),
    # What a camera sees: its depth as points, its frame, and the distance of a sonar.
    "camera": (ORBIT, ", ".join((
        display("DepthCloud", **DEPTH, Size_px=20),
        display("Axes", Reference_Frame="camera", Length=2, Radius=0.3), display("Range", Topic="/range"),
        display("WrenchStamped", Topic="/wrench", Arrow_Width=2),
    ))),
}
"""Whole files, as the packages have them that are named here, with the displays that these use most."""


UNNAMED_OFF = "{All Enabled: false, bare: {Value: false}}"
"""A file in which all frames but one have no value of their own."""
COLOURED = (*("on_map", "on_map_faint", "on_map_orbit", "on_map_orbit_faint", "on_map_see_through"),
    *("layout_navigation", "layout_gmapping", "layout_cartographer"))
"""Scenes whose silhouette consists of the coloured pixels, because a grey map covers the background."""
_OF_TURNED = ("}}", "}, Target Frame: turned}")
USUAL_SCENES: Mapping[str, tuple[str, str]] = {
    "robot": (ORTHO, ROBOT),
    "robot_orbit": (ORBIT, ROBOT),
    "robot_alpha": (ORTHO, display("RobotModel", Alpha=0.5)),
    "meshes": (ORTHO, display("RobotModel", Robot_Description="meshes")),
    "meshes_orbit": (ORBIT, display("RobotModel", Robot_Description="meshes")),
    "map": (ORTHO, display("Map", Topic="/map", Alpha=1)),
    "map_alpha": (ORBIT, display("Map", Topic="/map")),
    "costmap": (ORTHO, display("Map", Topic="/map", Color_Scheme="costmap")),
    "on_map": (ORTHO, on_a_map(Alpha=1)),
    "on_map_faint": (ORTHO, on_a_map()),
    "on_map_orbit": (ORBIT, on_a_map(Alpha=1)),
    "on_map_orbit_faint": (ORBIT, on_a_map()),
    "on_map_see_through": (ORTHO, on_a_map().replace("Arrow Length: 2", "Shape: Arrow (3D), Alpha: 0.6")),
    "cloud": (ORTHO, cloud()),
    "cloud_pixels": (ORTHO, display("PointCloud2", Topic="cloud", Style="Points", Size_px=30,
                                    Color_Transformer="FlatColor", Color="1; 20; 30")),
    "cloud_spheres": (ORTHO, cloud(Style="Spheres")),
    "cloud_boxes": (ORBIT, cloud(Size_m=0.8, Style="Boxes")),
    "scan": (ORTHO, display("LaserScan", Topic="/scan", Size_m=0.5, **FLAT)),
    "path": (ORTHO, display("Path", Topic="/path", Line_Style="Billboards", Line_Width=0.4)),
    "grid": (ORTHO, display("Grid", Alpha=1, Line_Style="{Value: Billboards, Line Width: 0.2}")),
    "axes": (ORBIT, display("Axes", Length=3, Radius=0.6)),
    "pose": (ORTHO, display("Pose", Topic="/pose", Shaft_Length=2, Shaft_Radius=0.6, Head_Length=1,
                            Head_Radius=1.2)),
    "pose_axes": (ORBIT, display("Pose", Topic="/pose", Shape="Axes", Axes_Length=2, Axes_Radius=0.5)),
    "pose_array": (ORTHO, display("PoseArray", Topic="/poses", Shape="Arrow (3D)", Shaft_Length=1,
                                  Shaft_Radius=0.2, Head_Length=0.6, Head_Radius=0.4)),
    "odometry": (ORTHO, display("Odometry", Topic="/odom",
                                Shape="{Value: Arrow, Shaft Radius: 0.4, Head Radius: 0.8}")),
    "covariance": (ORTHO, display("PoseWithCovariance", Topic="/covariance", Shaft_Radius=0.2)),
    "covariance_3d": (ORBIT, display(
        "PoseWithCovariance", Topic="/covariance_3d", Shaft_Radius=0.2,
        Covariance="{Position: {Value: false}, Orientation: {Offset: 3, Alpha: 1, Color Style: RGB}}")),
    "point": (ORTHO, display("PointStamped", Topic="/point", Radius=1)),
    "range": (ORTHO, display("Range", Topic="/range")),
    "cells": (ORTHO, display("GridCells", Topic="/cells")),
    "markers": (ORTHO, SHAPES),
    "markers_orbit": (ORBIT, SHAPES),
    "interactive": (ORTHO, display("InteractiveMarkers", Update_Topic="/controls/update")),
    "wrench": (ORBIT, display("WrenchStamped", Topic="/wrench", Arrow_Width=3)),
    "tf": (ORTHO, display("TF", Marker_Scale=6, Show_Names="false")),
    "tf_all_off": (ORTHO, display("TF", Marker_Scale=6, Show_Names="false", Frames=UNNAMED_OFF)),
    "ortho_turned": (ORTHO.replace("Scale: 50, X: 0, Y: 0, Angle: 0",
                                   "Scale: 40, X: 1, Y: -1, Angle: 0.5, Target Frame: turned"), SHAPES),
    "orbit_of_frame": (ORBIT.replace("}}", "}, Field of View: 1.1, Target Frame: turned}"), SHAPES),
    "orbit_inverted": (ORBIT.replace("X: 0, Y: 0, Z: 0}}", "X: 1, Y: -2, Z: 0.5}, Invert Z Axis: true}"),
                       SHAPES),
    "ortho_inverted": (ORTHO.replace("X: 0, Y: 0, Angle: 0", "X: 1, Y: -1, Angle: 0.5, Invert Z Axis: true"),
                       SHAPES),
    "fps_rolled": (FPS.replace("Roll: 0", "Roll: 0.3, Invert Z Axis: true"), SHAPES),
    "xy_orbit": (ORBIT.replace("Orbit", "XYOrbit", 1).replace(*_OF_TURNED), SHAPES),
    "follower": (ORBIT.replace("Orbit", "ThirdPersonFollower", 1).replace(*_OF_TURNED), SHAPES),
    "fps": (FPS, SHAPES),
    "marker": (ORBIT, display("Marker", Marker_Topic="/visualization_marker")),
    "polygon": (ORTHO, display("Polygon", Topic="/polygon")),
    "group": (ORTHO, f"{{Class: rviz/Group, Name: G, Enabled: true, Displays: ["
                     f"{display('Polygon', Topic='/polygon')}, {display('Axes', Length=2, Radius=0.4)}]}}"),
    "grid_lines": (ORTHO, display("Grid", Alpha=1, Plane_Cell_Count=4)),
    "grid_planes": (ORBIT, display("Grid", Alpha=1, Plane_Cell_Count=4, Normal_Cell_Count=2, Plane="YZ",
                                   Cell_Size=1.5)),
    "pose_array_flat": (ORTHO, display("PoseArray", Topic="/poses", Arrow_Length=2)),
    "path_arrows": (ORBIT, display("Path", Topic="/path", Pose_Style="Arrows", Shaft_Diameter=0.4,
                                   Head_Diameter=0.8, Length=1)),
    "old_cloud": (ORTHO, display("PointCloud", Topic="/old_cloud", Size_m=0.6, Channel_Name="heat",
                                 Color_Transformer="Intensity", Invert_Rainbow="true")),
    "cloud_rgb": (ORTHO, cloud("/rgb_cloud")),
    "cloud_axis": (ORBIT, display(
        "PointCloud2", Topic="/rgb_cloud", Size_px=30, Style="Points", Color_Transformer="AxisColor",
        Axis="X", Autocompute_Value_Bounds="{Value: false, Min Value: -5, Max Value: 3}")),
    "cloud_grey": (ORTHO, cloud(
        Color_Transformer="Intensity", Use_rainbow="false", Min_Color="10; 20; 30", Max_Color="200; 100; 50",
        Autocompute_Intensity_Bounds="false", Min_Intensity=-50, Max_Intensity=150, Alpha=0.5)),
    "spots": (ORTHO, ", ".join(
        display(kind, Topic=f"/{kind}", Size_m=1.5, Style="Boxes")
        for kind in ("Temperature", "FluidPressure", "Illuminance", "RelativeHumidity")
    )),
    "depth": (ORBIT, display("DepthCloud", **DEPTH, Size_px=30)),
} | {f"layout_{name}": layout for name, layout in LAYOUTS.items()}


def odd(name: str) -> str:
    return display("MarkerArray", Marker_Topic=f"/odd/{name}")


FAR = ORBIT.replace("Distance: 12", "Distance: 60").replace("Pitch: 0.9", "Pitch: 0.3")
ODD_ARRAYS = ", ".join((
    display("Path", Topic="/odd/path", Line_Style="Billboards", Line_Width=0.3, Color="255; 0; 0"),
    display("Path", Topic="/odd/turned_path", Line_Style="Billboards", Line_Width=0.3, Pose_Style="Axes"),
    display("Polygon", Topic="/odd/polygon"),
    display("GridCells", Topic="/odd/cells"),
    display("PoseArray", Topic="/odd/poses", Arrow_Length=1),
    display("Odometry", Topic="/odd/odom", Covariance="{Value: false}"),
    display("PointCloud", Topic="/odd/old_cloud", Size_m=0.5, Channel_Name="heat"),
    display("LaserScan", Topic="/odd/scan", Size_m=0.5),
    cloud("/odd/cloud", 0.5),
))
LONG = ", ".join((
    display("Grid", Alpha=1, Cell_Size=10, Plane_Cell_Count=100, Color="0; 0; 255", Offset=OFF_PIXELS),
    display("Path", Topic="/odd/long_path", Line_Style="Billboards", Line_Width=0.6, Color="255; 0; 0"),
    odd("long_lines"),
    display("TF", Marker_Scale=30, Show_Names="false"),
))
_ODD = ("numbers", "tints", "colours", "counts", "sizes", "arrows")
ODD_SCENES: Mapping[str, tuple[str, str]] = {
    **{f"odd_{name}": (ORTHO, odd(name)) for name in _ODD},
    "odd_meshes": (ORTHO,
        f"{odd('meshes')}, {display('RobotModel', Robot_Description='odd_robot', Visual_Enabled='false')}"),
    "odd_arrays": (ORTHO, ODD_ARRAYS),
    "odd_robot": (ORTHO, display("RobotModel", Robot_Description="odd_robot")),
    "long_lines": (FAR, LONG),
    "long_lines_near": (ORBIT, LONG),
    "long_lines_ortho": (ORTHO, LONG),
    "long_grid": (FAR, display("Grid", Alpha=1, Cell_Size=50, Plane_Cell_Count=20,
                               Line_Style="{Value: Billboards, Line Width: 1}")),
    "fine_cloud": (ORBIT.replace("Distance: 12", "Distance: 40"), cloud("/odd/fine_cloud", 0.02, **FLAT)),
}
"""Scenes of `odd_scene_program.py`: what rviz draws of messages and files that are odd."""
FINE = ("fine_cloud",)
"""Scenes of points smaller than a pixel, of which only the mean brightness is compared, within a third."""
SCENES: Mapping[str, tuple[str, str]] = {**USUAL_SCENES, **ODD_SCENES}


LEVELS = {"point": 3, "range": 4, "layout_camera": 5, "odd_colours": 3, "long_lines_near": 9}
"""Maximum difference of a colour channel in scenes that exceed `USUAL_LEVELS`.

Ogre computes the normals of curved surfaces differently, and rounds each of several layers of see-through
colours.
"""
USUAL_LEVELS = 2
OVERLAPS = {"xy_orbit": 0.97, "layout_cartographer": 0.97, "odd_counts": 0.96}
# fmt: on
"""Minimum overlap of the silhouettes in scenes that do not reach `USUAL_OVERLAP`.

The Scene tab does not turn squares with their frame. rviz draws lines with a negative alpha, one level
brighter than the background.
"""
USUAL_OVERLAP = 0.98


def config_of(name: str) -> str:
    """Return the text of the `.rviz` file for a scene."""
    view, displays = SCENES[name]
    return TEMPLATE.format(displays=displays, view=view)


def record_of(name: str, rgb: bytes) -> dict[str, Any]:
    """Return the record of a scene's picture of WIDTH by HEIGHT pixels, row by row from the top."""
    probes = {}
    for y in range(EDGE, HEIGHT - EDGE, STEP):
        for x in range(EDGE, WIDTH - EDGE, STEP):
            colour = pixel(rgb, x, y)
            if colour != BACKGROUND and is_inside(rgb, x, y, colour):
                probes[f"{x},{y}"] = list(colour)
    bits = silhouette(rgb, name in COLOURED)
    made: dict[str, Any] = {"probes": probes, "silhouette": base64.b64encode(zlib.compress(bits, 9)).decode()}
    return made | ({"mean": mean_difference(rgb)} if name in FINE else {})


def mean_difference(rgb: bytes) -> float:
    """Return the mean difference of all channels from the background."""
    return sum(abs(channel - BACKGROUND[0]) for channel in rgb) / len(rgb)


def pixel(rgb: bytes, x: int, y: int) -> tuple[int, int, int]:
    at = (y * WIDTH + x) * 3
    return rgb[at], rgb[at + 1], rgb[at + 2]


def is_inside(rgb: bytes, x: int, y: int, colour: Sequence[int]) -> bool:
    """Return whether the surrounding pixels have nearly the same colour."""
    around = (pixel(rgb, x + dx, y + dy) for dx in (-EDGE, 0, EDGE) for dy in (-EDGE, 0, EDGE))
    return all(abs(one - other) <= 5 for each in around for one, other in zip(each, colour, strict=True))


def silhouette(rgb: bytes, is_coloured: bool) -> bytes:
    """Return one bit for each pixel, which is set if the pixel differs from the background.

    With `is_coloured`, it is set if the pixel has a full colour (`FULL_COLOUR`) instead.
    """
    bits = bytearray((WIDTH * HEIGHT + 7) // 8)
    background = bytes(BACKGROUND)
    for number in range(WIDTH * HEIGHT):
        colour = rgb[number * 3 : number * 3 + 3]
        if (max(colour) - min(colour) >= FULL_COLOUR) if is_coloured else colour != background:
            bits[number >> 3] |= 1 << (number & 7)
    return bytes(bits)


def overlap(one: bytes, other: bytes) -> float:
    """Return the similarity of two silhouettes, from 0 to 1.

    Pixels of one silhouette that are neither in the other nor next to it reduce the result.
    """
    first, second = int.from_bytes(one, "little"), int.from_bytes(other, "little")
    union = (first | second).bit_count()
    outside = (first & ~_grown(second)).bit_count() + (second & ~_grown(first)).bit_count()
    return 1.0 - outside / union if union else 1.0


def _grown(bits: int) -> int:
    for step in (1, WIDTH):
        bits |= bits << step | bits >> step
    return bits


def unpacked(text: str) -> bytes:
    return zlib.decompress(base64.b64decode(text))
