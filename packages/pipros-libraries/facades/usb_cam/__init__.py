"""Replacement for Noetic's usb_cam: `usb_cam_node` publishes a camera's images, captured with OpenCV."""

from __future__ import annotations

import threading
import time
from typing import Any

from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Empty, EmptyResponse

import rospy
from camera_info_manager import CameraInfoManager
from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_libraries.vision.capture import CameraError, Capture


class UsbCam:
    """Publisher of a camera's images on `~image_raw` and of its calibration on `~camera_info`.

    The services `~start_capture` and `~stop_capture` switch publishing on and off.

    Raises:
        CameraError: the camera cannot be opened.
    """

    def __init__(self) -> None:
        self.rate_hz = max(float(rospy.get_param("~framerate", 30)), 0.1)
        self._frame = rospy.get_param("~camera_frame_id", "head_camera")
        width, height = rospy.get_param("~image_width", 640), rospy.get_param("~image_height", 480)
        pixel_format = rospy.get_param("~pixel_format", "mjpeg")
        self._capture = Capture(
            rospy.get_param("~video_device", "/dev/video0"), width, height, self.rate_hz, pixel_format
        )
        name = rospy.get_param("~camera_name", "head_camera")
        self._info = CameraInfoManager(name, rospy.get_param("~camera_info_url", ""), rospy.get_name())
        self._info.loadCameraInfo()
        self._images = rospy.Publisher("~image_raw", Image, queue_size=1)
        self._infos = rospy.Publisher("~camera_info", CameraInfo, queue_size=1)
        self._is_capturing = threading.Event()
        self._is_capturing.set()
        self._ended = threading.Event()
        rospy.on_shutdown(self._ended.set)
        rospy.Service("~start_capture", Empty, self._start)
        rospy.Service("~stop_capture", Empty, self._stop)
        rospy.loginfo(
            "Starting '%s' (%s) at %dx%d via OpenCV (%s) at %g FPS",
            name,
            self._capture.device,
            width,
            height,
            pixel_format,
            self.rate_hz,
        )

    def run(self) -> None:
        """Publish images until the node is shut down. If reading an image fails, shut the node down."""
        due_s = time.monotonic()
        while not self._ended.is_set():
            if self._is_capturing.wait(0.1):
                try:
                    self._publish(self._capture.read())
                except CameraError as error:
                    rospy.logerr("%s", error)
                    rospy.signal_shutdown(str(error))
                    return
            due_s = max(due_s + 1.0 / self.rate_hz, time.monotonic())
            self._ended.wait(due_s - time.monotonic())  # cameras do not follow simulated time

    def _publish(self, pixels: Any) -> None:
        height, width, channels = pixels.shape
        image = Image(height=height, width=width, encoding="rgb8", step=width * channels)
        image.header.stamp, image.header.frame_id = rospy.Time.now(), self._frame
        image.data = pixels.tobytes()
        info = self._info.getCameraInfo()
        info.header = image.header
        if not info.height:
            info.height, info.width = height, width
        self._images.publish(image)
        self._infos.publish(info)

    def _start(self, _: Any) -> Any:
        self._is_capturing.set()
        return EmptyResponse()

    def _stop(self, _: Any) -> Any:
        self._is_capturing.clear()
        return EmptyResponse()


@exits_after_ctrl_c()
def main() -> int:
    """Run `usb_cam_node` until the node is shut down. Return the exit code."""
    rospy.init_node("usb_cam")
    try:
        camera = UsbCam()
    except PiprosError as error:
        rospy.logfatal("%s", error)
        return 1
    # OpenCV may wait several seconds for an image. In the main thread, this would delay signal handlers.
    threading.Thread(target=camera.run, name="camera", daemon=True).start()
    rospy.spin()
    return 0
