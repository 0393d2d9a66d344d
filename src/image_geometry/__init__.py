"""image_geometry, as Noetic has it, on numpy: from pixels to rays, and back."""

from image_geometry.cameramodels import PinholeCameraModel as PinholeCameraModel
from image_geometry.cameramodels import StereoCameraModel as StereoCameraModel
