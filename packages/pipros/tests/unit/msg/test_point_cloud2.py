"""`sensor_msgs.point_cloud2`. tests.interop.test_clouds_as_genuine compares it with genuine ROS."""

import struct

import pytest
import sensor_msgs.point_cloud2 as point_cloud2
from sensor_msgs.msg import Image, PointCloud2, PointField
from std_msgs.msg import Header

CLOUD = point_cloud2.create_cloud_xyz32(Header(frame_id="laser"), [(1, 2, 3), (4, 5, float("nan"))])


def test_a_cloud_has_the_points_that_it_was_made_of() -> None:
    assert (CLOUD.header.frame_id, CLOUD.width, CLOUD.height, CLOUD.row_step) == ("laser", 2, 1, 24)
    assert list(point_cloud2.read_points(CLOUD, ("x", "y"))) == [(1.0, 2.0), (4.0, 5.0)]
    assert list(point_cloud2.read_points(CLOUD, skip_nans=True)) == [(1.0, 2.0, 3.0)]
    assert list(point_cloud2.read_points(CLOUD, ["x"], uvs=[(1, 0)])) == [(4.0,)]


def test_points_in_a_list_have_names() -> None:
    assert point_cloud2.read_points_list(CLOUD, ["z", "y"])[0]._asdict() == {"y": 2.0, "z": 3.0}


def test_an_image_in_colour_has_rows_and_gaps() -> None:
    fields = [PointField("rgb", 8, PointField.UINT32, 1), PointField("x", 0, PointField.INT16, 1)]
    points = [(1, 0xFF0000), (2, 0x00FF00), (3, 0x0000FF), (4, 0)]
    octets = [struct.pack(">hxxxxxxI", *point) for point in points]
    data = b"row1".join((octets[0] + octets[1], octets[2] + octets[3])) + b"row2"
    cloud = PointCloud2(
        height=2, width=2, fields=fields, is_bigendian=True, point_step=12, row_step=28, data=data
    )

    assert list(point_cloud2.read_points(cloud)) == points


def test_a_message_that_is_not_a_cloud_is_refused() -> None:
    with pytest.raises(AssertionError, match=r"cloud is not a sensor_msgs\.msg\.PointCloud2"):
        list(point_cloud2.read_points(Image()))


def test_too_little_data_is_an_error_that_names_the_point() -> None:
    points = point_cloud2.read_points(PointCloud2(**{**attributes(CLOUD), "data": CLOUD.data[:-1]}))

    assert next(points) == (1.0, 2.0, 3.0)
    with pytest.raises(struct.error):
        next(points)


def attributes(cloud: PointCloud2) -> dict[str, object]:
    return {name: getattr(cloud, name) for name in cloud.__slots__}
