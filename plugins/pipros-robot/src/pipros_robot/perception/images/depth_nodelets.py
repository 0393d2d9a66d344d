"""The nodelets of depth_image_proc: `convert_metric`, `point_cloud_xyz`, `point_cloud_xyzrgb`, `register`."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.nodes.inputs import SyncInput, inside, synchronized
from pipros_libraries.nodes.params import private
from pipros_libraries.topic_tools.lazy import LazyInputs, LazyNode
from pipros_libraries.transforms.listener import TransformListener
from pipros_libraries.transforms.matrices.quaternions import quaternion_matrix
from pipros_libraries.vision.conversions import ImageConversionError, convert
from pipros_libraries.vision.opencv import opencv
from pipros_robot.perception.images.arrays import BadImage, array_of, image_message
from pipros_robot.perception.images.clouds import cloud_message, empty_points, set_colors
from pipros_robot.perception.images.depths import converted_metric, registered, set_points
from pipros_robot.perception.images.disparity import CAMERA_INFO
from pipros_robot.perception.images.pinhole import Pinhole, binning, check_size
from pipros_robot.perception.images.ports import ERRORS_S, ImageOutput, camera, image_input, subscribe_image

if TYPE_CHECKING:
    from sensor_msgs.msg import CameraInfo, Image

    from pipros_libraries.vision.extras import Array


class ConvertMetric(LazyNode):
    """Converts `image_raw` from millimetres to metres or vice versa, while `image` has subscribers."""

    def __init__(self, node: Node) -> None:
        self._errors = Throttle(node.log, ERRORS_S)
        self._output = ImageOutput(node, "image", is_depth=True)
        self._inputs = LazyInputs(
            self._output.publishers,
            lambda: [subscribe_image(node, "image_raw", self._on_image, queue_size=1)],
        )

    def _on_image(self, message: Image) -> None:
        try:
            array, name = converted_metric(array_of(message), message.encoding)
        except PiprosError as error:
            self._errors.error("%s", error)
            return
        self._output.publish(image_message(array, name, message.header))


class PointCloudXyz(LazyNode):
    """Converts the depths in `image_rect` to a cloud, while `points` has subscribers."""

    def __init__(self, node: Node) -> None:
        self._errors = Throttle(node.log, ERRORS_S)
        self._output = node.advertise("points", load_message_class("sensor_msgs/PointCloud2"), queue_size=1)
        queue_size = private(node, "queue_size", 5)
        self._inputs = LazyInputs(
            [self._output],
            lambda: synchronized(node, camera(node, "image_rect"), self._on_depths, queue_size),
        )

    def _on_depths(self, message: Image, info: CameraInfo) -> None:
        try:
            depths = array_of(message)
            points = empty_points(message.height, message.width, has_colors=False)
            set_points(points, depths, message.encoding, Pinhole.of(info))
        except PiprosError as error:
            self._errors.error("%s", error)
            return
        self._output.publish(cloud_message(points, message.header))


class PointCloudXyzrgb(LazyNode):
    """Combines registered depths and the colours of `rgb` into `depth_registered/points`."""

    def __init__(self, node: Node) -> None:
        self._errors = Throttle(node.log, 5.0)
        depth, rgb = "depth_registered", "rgb"
        self._output = node.advertise(
            inside(node, depth, "points"), load_message_class("sensor_msgs/PointCloud2"), queue_size=1
        )
        queue_size, is_exact = private(node, "queue_size", 5), private(node, "exact_sync", False)
        transport = private(node, "depth_image_transport", "raw")
        inputs = [
            image_input(inside(node, depth, "image_rect"), transport),
            image_input(inside(node, rgb, "image_rect_color")),
            SyncInput(inside(node, rgb, "camera_info"), CAMERA_INFO),
        ]
        self._inputs = LazyInputs(
            [self._output],
            lambda: synchronized(
                node, inputs, self._on_images, queue_size, is_exact=is_exact, topic_queue_size=1
            ),
        )

    def _on_images(self, depth: Image, rgb: Image, info: CameraInfo) -> None:
        try:
            if depth.header.frame_id != rgb.header.frame_id:
                raise BadImage(
                    f"the frame of the depth image [{depth.header.frame_id}] must equal the frame of the "
                    f"colour image [{rgb.header.frame_id}]; register the depth image"
                )
            depths = array_of(depth)  # check the size before allocating memory
            pixels, name, pinhole = _fitted(array_of(rgb), rgb, depth, Pinhole.of(info))
            points = empty_points(depth.height, depth.width, has_colors=True)
            set_points(points, depths, depth.encoding, pinhole)
            set_colors(points, pixels, name, alpha=255)
        except PiprosError as error:
            self._errors.error("%s", error)
            return
        self._output.publish(cloud_message(points, depth.header))


def _fitted(pixels: Array, rgb: Image, depth: Image, pinhole: Pinhole) -> tuple[Array, str, Pinhole]:
    """Resize a colour image to a depth image's size. Return the image, its encoding and the scaled camera.

    As in depth_image_proc, the lower rows of a colour image that is relatively taller are cut off.
    """
    if (rgb.width, rgb.height) == (depth.width, depth.height):
        return pixels, rgb.encoding, pinhole
    ratio = depth.width / rgb.width
    if depth.height < ratio:
        raise BadImage(f"the depth image has too few rows ({depth.height}) for the size of the colour image")
    try:
        pixels = convert(pixels, rgb.encoding, "bgr8")[: int(depth.height / ratio)]
    except ImageConversionError as error:
        raise BadImage(str(error)) from error
    cv2 = opencv("resizing images")
    scaled = replace(
        pinhole,
        fx=pinhole.fx * ratio,
        fy=pinhole.fy * ratio,
        cx=pinhole.cx * ratio,
        cy=pinhole.cy * ratio,
        tx=pinhole.tx * ratio,
        ty=pinhole.ty * ratio,
    )
    return cv2.resize(pixels, (depth.width, depth.height)), "bgr8", scaled


class Register:
    """Publishes the depths of one camera as seen by another camera (`rgb`), while there are subscribers."""

    def __init__(self, node: Node) -> None:
        self._errors = Throttle(node.log, 2.0)
        self._fills_holes = private(node, "fill_upsampling_holes", False)
        self._uses_rgb_time = private(node, "use_rgb_timestamp", False)
        self._transforms = TransformListener(node)
        self._output = ImageOutput(node, inside(node, "depth_registered", "image_rect"), is_depth=True)
        self._info = node.advertise(
            inside(node, "depth_registered", "camera_info"), load_message_class(CAMERA_INFO), queue_size=1
        )
        queue_size = private(node, "queue_size", 5)
        inputs = [
            image_input(inside(node, "depth", "image_rect")),
            SyncInput(inside(node, "depth", "camera_info"), CAMERA_INFO),
            SyncInput(inside(node, "rgb", "camera_info"), CAMERA_INFO),
        ]
        self._inputs = LazyInputs(
            [*self._output.publishers, self._info],
            lambda: synchronized(
                node, inputs, self._on_depths, queue_size, is_exact=False, topic_queue_size=1
            ),
        )

    def _on_depths(self, depth: Image, depth_info: CameraInfo, rgb_info: CameraInfo) -> None:
        try:
            *position, qx, qy, qz, qw = self._transforms.at(
                rgb_info.header.frame_id.removeprefix("/"),
                depth_info.header.frame_id.removeprefix("/"),
                depth_info.header.stamp.to_nsec(),
            )
            transform = quaternion_matrix((qx, qy, qz, qw))
            transform[:3, 3] = position
            bin_x, bin_y = binning(rgb_info)
            size = (
                (rgb_info.roi.height or rgb_info.height) // bin_y,
                (rgb_info.roi.width or rgb_info.width) // bin_x,
            )
            check_size(*size)
            seen = registered(
                array_of(depth),
                depth.encoding,
                Pinhole.of(depth_info),
                Pinhole.of(rgb_info),
                size,
                transform,
                fills_holes=self._fills_holes,
            )
        except PiprosError as error:
            self._errors.error("cannot register depths: %s", error)
            return
        info = copy.copy(rgb_info)
        info.header = copy.copy(rgb_info.header)
        if not self._uses_rgb_time:
            info.header.stamp = depth.header.stamp
        name = "16UC1" if depth.encoding == "mono16" else depth.encoding
        self._output.publish(image_message(seen, name, info.header))
        self._info.publish(info)

    def close(self) -> None:
        """Unsubscribe."""
        self._inputs.close()
        self._transforms.close()
