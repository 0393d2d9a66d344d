"""Services of opencv_apps, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
import opencv_apps.msg
import sensor_msgs.msg

class FaceRecognitionTrainRequest(_base.Message):
    """Teaches the face recognition faces and their names."""
    images: list[sensor_msgs.msg.Image]
    """pictures with one face to learn in each"""
    rects: list[opencv_apps.msg.Rect]
    """where that face is, in the same order, pixels"""
    labels: list[str]
    """the person, in the same order"""
    def __init__(self, images: list[sensor_msgs.msg.Image] | None = ..., rects: list[opencv_apps.msg.Rect] | None = ..., labels: list[str] | None = ...) -> None: ...

class FaceRecognitionTrainResponse(_base.Message):
    ok: bool
    """true if it has learnt them"""
    error: str
    """human-readable: why it has not"""
    def __init__(self, ok: bool | None = ..., error: str | None = ...) -> None: ...

class FaceRecognitionTrain:
    """Teaches the face recognition faces and their names."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[FaceRecognitionTrainRequest]]
    _response_class: _ClassVar[type[FaceRecognitionTrainResponse]]
