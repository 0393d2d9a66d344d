"""Pairs of images, and shapes over images: detections of two releases of vision_msgs, and markers."""

# needs numpy
import math
import struct
from types import SimpleNamespace as Fields
from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from image_geometry import PinholeCameraModel
from pipros.node.any_msg import AnyMsg
from pipros_page.images.overlays import (
    MAX_MARKERS,
    MAX_PARTS,
    Camera,
    OverlayMarkers,
    detection_shapes,
    marker_shapes,
)
from pipros_page.images.pairs import ImagePairs
from pipros_page.topic_watch import TopicWatch
from pipros_page.views.images import info_topic
from pipros_tools.graph.raw_decoder import RawDecoder

IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
INFO = CameraInfo(width=640, height=480, P=[500, 0, 320, 0, 0, 400, 240, 0, 0, 0, 1, 0])
INFO.K = [500, 0, 320, 0, 400, 240, 0, 0, 1]
INFO.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]


def detections(*, is_new: bool, theta: float = 0.0) -> Any:
    scored = [("cat", 0.2), ("dog", 0.9)]
    if is_new:
        centre: Any = Fields(position=Fields(x=100.0, y=50.0), theta=theta)
        results: Any = [Fields(hypothesis=Fields(class_id=name, score=score)) for name, score in scored]
    else:
        centre = Fields(x=100.0, y=50.0, theta=theta)
        results = [Fields(id=name, score=score) for name, score in scored]
    bbox = Fields(center=centre, size_x=20.0, size_y=10.0)
    return Fields(detections=[Fields(bbox=bbox, results=results), Fields(bbox=bbox, results=[])])


@pytest.mark.parametrize("is_new", [False, True])
def test_detections_of_both_releases_are_boxes_with_the_best_result(is_new: bool) -> None:
    (shape,) = detection_shapes(detections(is_new=is_new))
    edges = [
        90.0, 45.0, 110.0, 45.0, 110.0, 45.0, 110.0, 55.0, 110.0, 55.0, 90.0, 55.0, 90.0, 55.0, 90.0, 45.0,
    ]  # fmt: skip
    assert (shape["lines"], shape["texts"]) == (edges * 2, [[90.0, 45.0, "dog 0.90"]])


def test_detections_are_turned_and_left_out_if_they_are_not_finite() -> None:
    (shape,) = detection_shapes(detections(is_new=False, theta=math.pi / 2))
    assert shape["lines"][:4] == [105.0, 40.0, 105.0, 60.0]
    assert detection_shapes(detections(is_new=False, theta=math.nan))[0]["lines"] == []
    with pytest.raises(AttributeError, match="bbox"):
        detection_shapes(Fields(detections=[Fields()]))


def marker(kind: int, **fields: Any) -> Marker:
    made = Marker(
        header=Header(frame_id="tag"), type=kind, scale=Vector3(0.2, 0.2, 0.2), color=ColorRGBA(1, 0.5, 0, 1)
    )
    made.pose = Pose(position=Point(0.5, -0.25, 2.0), orientation=Quaternion(w=1.0))
    for name, value in fields.items():
        setattr(made, name, value)
    return made


def shapes_of(*markers: Marker) -> list[Any]:
    return marker_shapes(markers, Camera(INFO), lambda _frame: IDENTITY)


def test_markers_are_where_image_geometry_projects_them() -> None:
    model = PinholeCameraModel()
    model.fromCameraInfo(INFO)
    points = [Point(0.1, 0.2, 0.0), Point(-0.3, 0.1, 0.5)]
    (shape,) = shapes_of(marker(Marker.LINE_STRIP, points=points))
    places = [(point.x + 0.5, point.y - 0.25, point.z + 2.0) for point in points]
    expected = [value for place in places for value in model.project3dToPixel(place)]
    assert (shape["lines"], shape["color"]) == (pytest.approx(expected, abs=0.06), "rgb(255 128 0)")
    (ball,) = shapes_of(marker(Marker.SPHERE))
    assert ball["circles"] == pytest.approx([*model.project3dToPixel((0.5, -0.25, 2.0)), 25.0], abs=0.06)


@pytest.mark.parametrize(("kind", "lines"), [
    (Marker.CUBE, 12), (Marker.CYLINDER, 34), (Marker.ARROW, 1), (Marker.MESH_RESOURCE, 12)
])  # fmt: skip
def test_solids_are_their_edges(kind: int, lines: int) -> None:
    (shape,) = shapes_of(marker(kind))
    assert len(shape["lines"]) == 4 * lines


def test_lines_end_before_the_camera_and_what_is_behind_it_is_left_out() -> None:
    through = marker(Marker.LINE_LIST, points=[Point(0, 0, 0), Point(0, 0, -3)])
    (shape,) = shapes_of(through)
    assert len(shape["lines"]) == 4
    behind = Pose(position=Point(0, 0, -2), orientation=Quaternion(w=1.0))
    for kind in (Marker.CUBE, Marker.SPHERE, Marker.TEXT_VIEW_FACING):
        (shape,) = shapes_of(marker(kind, pose=behind, text="x"))
        assert (shape["lines"], shape["circles"], shape.get("texts")) == ([], [], None)
    (text,) = shapes_of(marker(Marker.TEXT_VIEW_FACING, text="tag 7"))
    assert text["texts"] == [[445.0, 190.0, "tag 7"]]


def test_triangles_and_points_are_drawn_up_to_a_limit() -> None:
    corners = [Point(0, 0, 0), Point(1, 0, 0), Point(0, 1, 0)]
    (shape,) = shapes_of(marker(Marker.TRIANGLE_LIST, points=corners))
    assert len(shape["lines"]) == 12
    many = marker(Marker.POINTS, points=[Point()] * (MAX_PARTS + 10))
    shapes = shapes_of(many, many)
    assert [len(each["circles"]) // 3 for each in shapes] == [MAX_PARTS]
    for tiny in (5e-324, 3e-162, 1e-200, 1e-149):
        assert shapes_of(marker(Marker.CUBE, pose=Pose(orientation=Quaternion(x=tiny)))) != []


def test_markers_are_replaced_deleted_and_expire() -> None:
    markers = OverlayMarkers()
    first = marker(Marker.CUBE, ns="a", id=1)
    first.lifetime.secs = 5
    markers.add(MarkerArray([first, marker(Marker.CUBE, ns="a", id=2)]), 10.0)
    assert len(markers.shown(14.0)) == 2
    assert [each.id for each in markers.shown(15.5)] == [2]
    markers.add(marker(Marker.SPHERE, ns="a", id=2), 16.0)
    assert [each.type for each in markers.shown(16.0)] == [Marker.SPHERE]
    markers.add(marker(Marker.SPHERE, ns="a", id=2, action=Marker.DELETE), 17.0)
    assert markers.shown(17.0) == []
    for number in range(MAX_MARKERS + 5):
        markers.add(marker(Marker.CUBE, ns="b", id=number), 18.0)
    assert len(markers.shown(18.0)) == MAX_MARKERS
    markers.add(Marker(action=Marker.DELETEALL), 19.0)
    assert markers.shown(19.0) == []


def test_a_camera_without_a_calibration_is_refused() -> None:
    with pytest.raises(ValueError, match="not calibrated"):
        Camera(CameraInfo())


def test_the_camera_info_is_beside_the_image_or_its_base() -> None:
    types = {"/cam/camera_info": "sensor_msgs/CameraInfo"}
    assert info_topic("/cam/image_raw", types) == "/cam/camera_info"
    assert info_topic("/cam/image_raw/compressed", types) == "/cam/camera_info"
    assert info_topic("/other/image", types) == "/other/camera_info"


def received(body: bytes) -> AnyMsg:
    message = AnyMsg(body)
    message._connection_header = {}
    return message


def image(stamp_s: float) -> AnyMsg:
    seconds = int(stamp_s)
    return received(struct.pack("<IIII", 0, seconds, round((stamp_s - seconds) * 1e9), 0))


def test_images_of_about_the_same_time_are_a_pair() -> None:
    one, other = (TopicWatch(name, RawDecoder()) for name in ("/left", "/right"))
    pairs = ImagePairs()

    def newest() -> Any:
        return pairs.newest and (pairs.newest[0], [each.body[4:12] for each in pairs.newest[1]])

    with pairs.of(one, other):
        one.note(image(1.0))
        other.note(image(1.3))
        assert newest() is None
        other.note(image(1.05))
        one.note(received(b"short"))
        assert newest() == (1, [image(1.0).body[4:12], image(1.05).body[4:12]])
        one.note(image(1.31))
        assert newest() == (2, [image(1.31).body[4:12], image(1.3).body[4:12]])
