"""Services of tf2_web_republisher, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
from pipros.msg import time as _time

class RepublishTFsRequest(_base.Message):
    """Publishes the transforms of some frames on a new topic, when they have changed enough."""
    source_frames: list[str]
    """frames whose transforms are wanted"""
    target_frame: str
    """frame in which they are given"""
    angular_thres: float
    """send a transform after a turn by twice this angle, in radians"""
    trans_thres: float
    """or a movement by this distance, in metres"""
    rate: float
    """maximum rate of checks, in Hz"""
    timeout: _time.Duration
    """stop after this time without a subscriber"""
    def __init__(self, source_frames: list[str] | None = ..., target_frame: str | None = ..., angular_thres: float | None = ..., trans_thres: float | None = ..., rate: float | None = ..., timeout: _time.Duration | None = ...) -> None: ...

class RepublishTFsResponse(_base.Message):
    topic_name: str
    """of TFArray messages"""
    def __init__(self, topic_name: str | None = ...) -> None: ...

class RepublishTFs:
    """Publishes the transforms of some frames on a new topic, when they have changed enough."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[RepublishTFsRequest]]
    _response_class: _ClassVar[type[RepublishTFsResponse]]
