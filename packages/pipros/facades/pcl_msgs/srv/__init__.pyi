"""Services of pcl_msgs, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base

class UpdateFilenameRequest(_base.Message):
    """Sets the file that a node reads."""
    filename: str
    """path on the node's machine"""
    def __init__(self, filename: str | None = ...) -> None: ...

class UpdateFilenameResponse(_base.Message):
    success: bool
    """true if the file was accepted"""
    def __init__(self, success: bool | None = ...) -> None: ...

class UpdateFilename:
    """Sets the file that a node reads."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[UpdateFilenameRequest]]
    _response_class: _ClassVar[type[UpdateFilenameResponse]]
