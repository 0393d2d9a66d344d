"""Messages of roscpp, made from their definitions by `pipros stubs`."""

from pipros.msg import base as _base

class Logger(_base.Message):
    """A logger of a node and its level."""
    name: str
    """such as ros.roscpp or rosout"""
    level: str
    """debug, info, warn, error or fatal; lines below it are dropped"""
    def __init__(self, name: str | None = ..., level: str | None = ...) -> None: ...
