"""Services of tf, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base

class FrameGraphRequest(_base.Message):
    """Draws the frames that a tf listener knows; nodes offer it as NODE/tf_frames. The request is empty."""
    def __init__(self) -> None: ...

class FrameGraphResponse(_base.Message):
    dot_graph: str
    """the tree in the language of graphviz"""
    def __init__(self, dot_graph: str | None = ...) -> None: ...

class FrameGraph:
    """Draws the frames that a tf listener knows; nodes offer it as NODE/tf_frames. The request is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[FrameGraphRequest]]
    _response_class: _ClassVar[type[FrameGraphResponse]]
