"""Services of roscpp_tutorials, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base

class TwoIntsRequest(_base.Message):
    """For the tutorials: adds two numbers."""
    a: int
    """first summand"""
    b: int
    """second summand"""
    def __init__(self, a: int | None = ..., b: int | None = ...) -> None: ...

class TwoIntsResponse(_base.Message):
    sum: int
    """a plus b"""
    def __init__(self, sum: int | None = ...) -> None: ...

class TwoInts:
    """For the tutorials: adds two numbers."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[TwoIntsRequest]]
    _response_class: _ClassVar[type[TwoIntsResponse]]
