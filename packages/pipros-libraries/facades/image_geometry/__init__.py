"""Drop-in replacement for Noetic's image_geometry, with numpy: camera models."""

from image_geometry.cameramodels import PinholeCameraModel as PinholeCameraModel
from image_geometry.cameramodels import StereoCameraModel as StereoCameraModel
