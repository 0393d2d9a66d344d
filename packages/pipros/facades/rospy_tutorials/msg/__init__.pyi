"""Messages of rospy_tutorials, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
import std_msgs.msg

class Floats(_base.Message):
    """For the tutorials: a list of numbers, for numpy_msg."""
    @property
    def data(self) -> _Sequence[float]:
        """any number of them"""
    @data.setter
    def data(self, value: _types.Array[float]) -> None: ...
    def __init__(self, data: _types.Array[float] | None = ...) -> None: ...

class HeaderString(_base.Message):
    """For the tutorials: a text with a header."""
    header: std_msgs.msg.Header
    """stamp: when it was sent"""
    data: str
    """the text"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., data: str | None = ...) -> None: ...
