"""Services of roscpp, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
import roscpp.msg

class EmptyRequest(_base.Message):
    """Triggers an action; the response is empty. New services use std_srvs/Empty or Trigger."""
    def __init__(self) -> None: ...

class EmptyResponse(_base.Message):
    def __init__(self) -> None: ...

class GetLoggersRequest(_base.Message):
    """Lists the loggers of a node; every node offers it as NODE/get_loggers. The request is empty."""
    def __init__(self) -> None: ...

class GetLoggersResponse(_base.Message):
    loggers: list[roscpp.msg.Logger]
    """all of them with their levels"""
    def __init__(self, loggers: list[roscpp.msg.Logger] | None = ...) -> None: ...

class SetLoggerLevelRequest(_base.Message):
    """Sets the level of a logger while the node runs; every node offers it as NODE/set_logger_level. The response
    is empty."""
    logger: str
    """name of the logger, as returned by GetLoggers"""
    level: str
    """debug, info, warn, error or fatal"""
    def __init__(self, logger: str | None = ..., level: str | None = ...) -> None: ...

class SetLoggerLevelResponse(_base.Message):
    def __init__(self) -> None: ...

class Empty:
    """Triggers an action; the response is empty. New services use std_srvs/Empty or Trigger."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[EmptyRequest]]
    _response_class: _ClassVar[type[EmptyResponse]]

class GetLoggers:
    """Lists the loggers of a node; every node offers it as NODE/get_loggers. The request is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetLoggersRequest]]
    _response_class: _ClassVar[type[GetLoggersResponse]]

class SetLoggerLevel:
    """Sets the level of a logger while the node runs; every node offers it as NODE/set_logger_level. The response
    is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SetLoggerLevelRequest]]
    _response_class: _ClassVar[type[SetLoggerLevelResponse]]
