"""Messages of stereo_msgs, made from their definitions by `pipros stubs`."""

from pipros.msg import base as _base
import sensor_msgs.msg
import std_msgs.msg

class DisparityImage(_base.Message):
    """The shift of each pixel of a stereo pair's left image in the right image. stereo_image_proc
    publishes it on disparity. Depth in metres is f * T / disparity."""
    header: std_msgs.msg.Header
    """the header of the left image"""
    image: sensor_msgs.msg.Image
    """disparity of each pixel as 32FC1, in pixels; below min_disparity: none found"""
    f: float
    """focal length of the rectified images, pixels"""
    T: float
    """distance of the two cameras (baseline), metres"""
    valid_window: sensor_msgs.msg.RegionOfInterest
    """the part of the image in which disparities can be found"""
    min_disparity: float
    """smallest disparity that was searched for, pixels; belongs to the largest depth"""
    max_disparity: float
    """largest disparity that was searched for, pixels; belongs to the smallest depth"""
    delta_d: float
    """smallest step between disparities, pixels; depth has steps of Z * Z / (f * T) * delta_d"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., image: sensor_msgs.msg.Image | None = ..., f: float | None = ..., T: float | None = ..., valid_window: sensor_msgs.msg.RegionOfInterest | None = ..., min_disparity: float | None = ..., max_disparity: float | None = ..., delta_d: float | None = ...) -> None: ...
