"""Small pictures of messages."""

import base64
import json
import math
from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose, PoseStamped
from nav_msgs.msg import MapMetaData, OccupancyGrid, Path
from sensor_msgs.msg import CompressedImage, Image, Imu, LaserScan

from pipros.safe.expr_walk import ExpressionError
from pipros_page.messages.pattern import MessagePattern
from pipros_page.messages.picture import COMPRESSED_BYTES, MAX_CELLS, MAX_POINTS, message_picture


def picture_of(message: Any) -> Any:
    found = message_picture(message)
    assert found is not None
    return found


def test_a_scan_is_drawn_as_points_without_those_out_of_range() -> None:
    scan = LaserScan(angle_increment=math.pi / 2, range_min=0.5, range_max=5.0, ranges=[1, 0.1, 2, math.inf])
    assert picture_of(scan) == {"kind": "points", "points": [1.0, 0.0, -2.0, 0.0], "joined": False}
    scan.ranges = [1.0] * 10 * MAX_POINTS
    assert len(picture_of(scan)["points"]) == 2 * MAX_POINTS


def test_a_path_is_a_line() -> None:
    poses = [PoseStamped(pose=Pose(position=Point(x, y, 0))) for x, y in ((1, 2), (math.nan, 0), (3, 4))]
    assert picture_of(Path(poses=poses)) == {"kind": "points", "points": [1, 2, 3, 4], "joined": True}


def test_a_map_is_thinned_out() -> None:
    grid = OccupancyGrid(info=MapMetaData(width=2, height=2), data=[0, 100, -1, 50])
    picture = picture_of(grid)
    assert (picture["width"], picture["height"]) == (2, 2)
    assert list(base64.b64decode(picture["cells"])) == [0, 100, 255, 50]
    side = 3 * MAX_CELLS
    large = OccupancyGrid(info=MapMetaData(width=side, height=3), data=[7] * side * 3)
    assert len(base64.b64decode(picture_of(large)["cells"])) == MAX_CELLS
    assert message_picture(OccupancyGrid(info=MapMetaData(width=9, height=9))) is None


def test_an_image_is_small() -> None:
    image = Image(width=1000, height=1000, step=1000, encoding="mono8", data=bytes(1_000_000))
    head, _, pixels = base64.b64decode(picture_of(image)["data"]).partition(b"\n")
    assert json.loads(head)["full"] == [1000, 1000]
    assert len(pixels) <= 60_000


@pytest.mark.parametrize("message", [
    Imu(), Image(encoding="unknown9", width=1, height=1),
    CompressedImage(format="jpeg", data=bytes(COMPRESSED_BYTES + 1)),
])  # fmt: skip
def test_other_messages_have_no_picture(message: Any) -> None:
    assert message_picture(message) is None


# Messages with expressions of time and count.


def test_texts_that_begin_with_an_equals_sign_are_evaluated() -> None:
    pattern = MessagePattern({"x": "=2 * i", "all": ["=t", {"name": "=f'step {i}'"}], "is_on": "=i % 2 == 1"})
    assert pattern.value(3, 1.5) == {"x": 6, "all": [1.5, {"name": "step 3"}], "is_on": True}


@pytest.mark.parametrize("value", ["== title ==", "a = b", "", 7, None, [1, 2]])
def test_other_values_stay(value: object) -> None:
    assert MessagePattern({"x": value}).value(0, 0.0) == {"x": value}


def test_errors_name_the_expression() -> None:
    with pytest.raises(ExpressionError, match=r"\[1 \+\]"):
        MessagePattern({"x": "=1 +"})
    with pytest.raises(ExpressionError, match="nothing"):
        MessagePattern({"x": "=nothing"}).value(0, 0.0)


def test_expressions_cannot_reach_the_interpreter() -> None:
    with pytest.raises(ExpressionError):
        MessagePattern({"x": "=().__class__"}).value(0, 0.0)
