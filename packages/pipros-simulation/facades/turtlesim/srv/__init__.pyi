"""Services of turtlesim, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base

class KillRequest(_base.Message):
    """Removes a turtle; the lines that it drew stay."""
    name: str
    """the name of the turtle"""
    def __init__(self, name: str | None = ...) -> None: ...

class KillResponse(_base.Message):
    def __init__(self) -> None: ...

class SetPenRequest(_base.Message):
    """Sets the pen of a turtle."""
    r: int
    """red"""
    g: int
    """green"""
    b: int
    """blue"""
    width: int
    """pixels; 0 draws like 1"""
    off: int
    """if not 0, the pen is lifted and keeps its colour and width"""
    def __init__(self, r: int | None = ..., g: int | None = ..., b: int | None = ..., width: int | None = ..., off: int | None = ...) -> None: ...

class SetPenResponse(_base.Message):
    def __init__(self) -> None: ...

class SpawnRequest(_base.Message):
    """Adds a turtle."""
    x: float
    """m, from the left edge"""
    y: float
    """m, from the lower edge"""
    theta: float
    """rad, from the x axis, counter-clockwise"""
    name: str
    """if empty, a new name is made"""
    def __init__(self, x: float | None = ..., y: float | None = ..., theta: float | None = ..., name: str | None = ...) -> None: ...

class SpawnResponse(_base.Message):
    name: str
    """the name of the turtle"""
    def __init__(self, name: str | None = ...) -> None: ...

class TeleportAbsoluteRequest(_base.Message):
    """Moves a turtle to a pose in the next tick."""
    x: float
    """m, from the left edge"""
    y: float
    """m, from the lower edge"""
    theta: float
    """rad, from the x axis, counter-clockwise"""
    def __init__(self, x: float | None = ..., y: float | None = ..., theta: float | None = ...) -> None: ...

class TeleportAbsoluteResponse(_base.Message):
    def __init__(self) -> None: ...

class TeleportRelativeRequest(_base.Message):
    """Turns a turtle, then moves it in its new direction, in the next tick."""
    linear: float
    """m, forwards"""
    angular: float
    """rad, counter-clockwise"""
    def __init__(self, linear: float | None = ..., angular: float | None = ...) -> None: ...

class TeleportRelativeResponse(_base.Message):
    def __init__(self) -> None: ...

class Kill:
    """Removes a turtle; the lines that it drew stay."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[KillRequest]]
    _response_class: _ClassVar[type[KillResponse]]

class SetPen:
    """Sets the pen of a turtle."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SetPenRequest]]
    _response_class: _ClassVar[type[SetPenResponse]]

class Spawn:
    """Adds a turtle."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SpawnRequest]]
    _response_class: _ClassVar[type[SpawnResponse]]

class TeleportAbsolute:
    """Moves a turtle to a pose in the next tick."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[TeleportAbsoluteRequest]]
    _response_class: _ClassVar[type[TeleportAbsoluteResponse]]

class TeleportRelative:
    """Turns a turtle, then moves it in its new direction, in the next tick."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[TeleportRelativeRequest]]
    _response_class: _ClassVar[type[TeleportRelativeResponse]]
