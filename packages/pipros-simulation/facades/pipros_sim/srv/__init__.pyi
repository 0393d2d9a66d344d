"""Services of pipros_sim, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
from pipros.msg import time as _time

class AdvanceRequest(_base.Message):
    """Ask a node to finish all work that is due at a simulated time: Lockstep in the guide about simulation."""
    now: _time.Time
    """the simulated time"""
    topics: list[str]
    """topics of the links to this node, which first handles all messages sent over them"""
    publishers: list[str]
    """the publishers of these links"""
    @property
    def counts(self) -> _Sequence[int]:
        """numbers of messages sent over them so far"""
    @counts.setter
    def counts(self, value: _types.Array[int]) -> None: ...
    def __init__(self, now: _time.Time | None = ..., topics: list[str] | None = ..., publishers: list[str] | None = ..., counts: _types.Array[int] | None = ...) -> None: ...

class AdvanceResponse(_base.Message):
    hold: bool
    """whether the time must stand still until the next call"""
    due: _time.Time
    """when the next work of the node is due; the node is also called after each step with scans"""
    topics: list[str]
    """topics of the links from this node to subscribers"""
    subscribers: list[str]
    """the subscribers of these links"""
    @property
    def counts(self) -> _Sequence[int]:
        """numbers of messages sent over them so far"""
    @counts.setter
    def counts(self, value: _types.Array[int]) -> None: ...
    def __init__(self, hold: bool | None = ..., due: _time.Time | None = ..., topics: list[str] | None = ..., subscribers: list[str] | None = ..., counts: _types.Array[int] | None = ...) -> None: ...

class PlaceRequest(_base.Message):
    """Move a robot to a pose and stop it. The call fails if a wall, a robot or an obstacle is there."""
    x: float
    """metres in the frame of the map"""
    y: float
    """metres in the frame of the map"""
    theta: float
    """radians, counter-clockwise from x"""
    def __init__(self, x: float | None = ..., y: float | None = ..., theta: float | None = ...) -> None: ...

class PlaceResponse(_base.Message):
    def __init__(self) -> None: ...

class Advance:
    """Ask a node to finish all work that is due at a simulated time: Lockstep in the guide about simulation."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[AdvanceRequest]]
    _response_class: _ClassVar[type[AdvanceResponse]]

class Place:
    """Move a robot to a pose and stop it. The call fails if a wall, a robot or an obstacle is there."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[PlaceRequest]]
    _response_class: _ClassVar[type[PlaceResponse]]
