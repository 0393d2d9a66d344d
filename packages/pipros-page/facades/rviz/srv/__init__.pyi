"""Services of rviz, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
import std_msgs.msg

class SendFilePathRequest(_base.Message):
    """Makes rviz load or save its configuration; RVIZ/load_config and RVIZ/save_config."""
    path: std_msgs.msg.String
    """the file, on the machine of rviz"""
    def __init__(self, path: std_msgs.msg.String | None = ...) -> None: ...

class SendFilePathResponse(_base.Message):
    success: bool
    """true if it was loaded or saved"""
    def __init__(self, success: bool | None = ...) -> None: ...

class SendFilePath:
    """Makes rviz load or save its configuration; RVIZ/load_config and RVIZ/save_config."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SendFilePathRequest]]
    _response_class: _ClassVar[type[SendFilePathResponse]]
