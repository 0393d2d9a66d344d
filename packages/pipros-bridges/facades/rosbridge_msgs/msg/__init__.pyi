"""Messages of rosbridge_msgs, made from their definitions by `pipros stubs`."""

from pipros.msg import base as _base
from pipros.msg import time as _time

class ConnectedClient(_base.Message):
    """One client of a rosbridge server."""
    ip_address: str
    """address of the client"""
    connection_time: _time.Time
    """when it connected"""
    def __init__(self, ip_address: str | None = ..., connection_time: _time.Time | None = ...) -> None: ...

class ConnectedClients(_base.Message):
    """All clients of a rosbridge server."""
    clients: list[ConnectedClient]
    """in the order of their connections"""
    def __init__(self, clients: list[ConnectedClient] | None = ...) -> None: ...
