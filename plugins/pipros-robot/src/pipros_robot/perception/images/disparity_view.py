"""The program `disparity_view` of image_view, which shows disparity images in colour in an OpenCV window."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.nodes.params import private
from pipros_libraries.vision.extras import numpy as np
from pipros_libraries.vision.opencv import opencv
from pipros_robot.perception.images.arrays import BadImage, array_of
from pipros_robot.perception.windows.replacement import show_windows_on_page

if TYPE_CHECKING:
    from stereo_msgs.msg import DisparityImage

    from pipros_libraries.vision.extras import Array

_KEY_MS = 30


def shown(message: DisparityImage) -> Array:
    """Convert a disparity image to colours (bgr8), from blue for the minimum to red for the maximum.

    Raises:
        BadImage: the image is not 32FC1, or its minimum and maximum are equal.
    """
    low, high = message.min_disparity, message.max_disparity
    if message.image.encoding != "32FC1":
        raise BadImage(f"disparities must be 32FC1, got [{message.image.encoding}]")
    if low == high:
        raise BadImage("min_disparity and max_disparity must differ")
    cv2 = opencv("showing disparities")
    with np.errstate(invalid="ignore"):
        index = np.nan_to_num((array_of(message.image) - low) * (255.0 / (high - low)) + 0.5)
    found: Array = cv2.applyColorMap(np.clip(index, 0, 255).astype(np.uint8), cv2.COLORMAP_JET)
    return found


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run `disparity_view` until the node is shut down. Return the exit code."""
    with roscpp_program("disparity_view", "image_view", argv, anonymous=True) as (node, log):
        cv2 = opencv("showing disparities")
        show_windows_on_page(cv2, node)
        errors = Throttle(log, 30.0)
        name = private(node, "window_name", node.resolve("image"))
        cv2.namedWindow(name, cv2.WINDOW_AUTOSIZE if private(node, "autosize", False) else 0)
        latest: list[Array] = []
        lock = threading.Lock()

        def on_image(message: DisparityImage) -> None:
            try:
                picture = shown(message)
            except PiprosError as error:
                errors.error("%s", error)
                return
            with lock:
                latest[:] = [picture]

        node.subscribe(
            "image", load_message_class("stereo_msgs/DisparityImage"), on_image, queue_size=1, zero_copy=True
        )
        while not node.is_shutdown:
            with lock:
                pictures, latest[:] = latest[:], []
            for picture in pictures:
                cv2.imshow(name, picture)
            cv2.waitKey(_KEY_MS)
    return 0
