"""Messages of bond, made from their definitions by `pipros stubs`."""

from typing import Final as _Final
from pipros.msg import base as _base
import std_msgs.msg

class Constants(_base.Message):
    """The times of bonds, in seconds, and the parameter that disables their timeouts."""
    DEAD_PUBLISH_PERIOD: _Final = 0.05
    """between repeated messages that a bond is broken"""
    DEFAULT_CONNECT_TIMEOUT: _Final = 10.0
    """for the other side to appear"""
    DEFAULT_HEARTBEAT_TIMEOUT: _Final = 4.0
    """without a heartbeat, until the bond counts as broken"""
    DEFAULT_DISCONNECT_TIMEOUT: _Final = 2.0
    """for the other side to confirm the end"""
    DEFAULT_HEARTBEAT_PERIOD: _Final = 1.0
    """between two heartbeats"""
    DISABLE_HEARTBEAT_TIMEOUT_PARAM: _Final = '/bond_disable_heartbeat_timeout'
    """Set this parameter to true while debugging: bonds then do not break if heartbeats are missing."""
    def __init__(self) -> None: ...

class Status(_base.Message):
    """Heartbeat of one side of a bond, which lets two processes detect the end of the other."""
    header: std_msgs.msg.Header
    """stamp: when it was sent; frame_id is not used"""
    id: str
    """the bond: the same on both sides"""
    instance_id: str
    """the side: different on both"""
    active: bool
    """false: this side breaks the bond"""
    heartbeat_timeout: float
    """time without a heartbeat after which the bond is broken, seconds"""
    heartbeat_period: float
    """from one heartbeat to the next, seconds"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., id: str | None = ..., instance_id: str | None = ..., active: bool | None = ..., heartbeat_timeout: float | None = ..., heartbeat_period: float | None = ...) -> None: ...
