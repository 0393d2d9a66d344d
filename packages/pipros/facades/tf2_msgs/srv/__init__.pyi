"""Services of tf2_msgs, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base

class FrameGraphRequest(_base.Message):
    """Lists the frames that a tf2 buffer knows; nodes offer it as NODE/tf2_frames. The request is empty."""
    def __init__(self) -> None: ...

class FrameGraphResponse(_base.Message):
    frame_yaml: str
    """YAML: each frame's parent, sender, rate, and oldest and newest time"""
    def __init__(self, frame_yaml: str | None = ...) -> None: ...

class FrameGraph:
    """Lists the frames that a tf2 buffer knows; nodes offer it as NODE/tf2_frames. The request is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[FrameGraphRequest]]
    _response_class: _ClassVar[type[FrameGraphResponse]]
