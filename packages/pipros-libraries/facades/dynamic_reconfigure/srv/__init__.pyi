"""Services of dynamic_reconfigure, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
import dynamic_reconfigure.msg

class ReconfigureRequest(_base.Message):
    """Changes parameters of a running node, which offers it as NODE/set_parameters."""
    config: dynamic_reconfigure.msg.Config
    """the values to change"""
    def __init__(self, config: dynamic_reconfigure.msg.Config | None = ...) -> None: ...

class ReconfigureResponse(_base.Message):
    config: dynamic_reconfigure.msg.Config
    """the current values, which the node may have limited to their bounds"""
    def __init__(self, config: dynamic_reconfigure.msg.Config | None = ...) -> None: ...

class Reconfigure:
    """Changes parameters of a running node, which offers it as NODE/set_parameters."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ReconfigureRequest]]
    _response_class: _ClassVar[type[ReconfigureResponse]]
