"""Services of rospy_tutorials, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base

class AddTwoIntsRequest(_base.Message):
    """For the tutorials: adds two numbers."""
    a: int
    """first summand"""
    b: int
    """second summand"""
    def __init__(self, a: int | None = ..., b: int | None = ...) -> None: ...

class AddTwoIntsResponse(_base.Message):
    sum: int
    """a plus b"""
    def __init__(self, sum: int | None = ...) -> None: ...

class BadTwoIntsRequest(_base.Message):
    """For the tutorials: differs from AddTwoInts in types, and so in its md5, to show how a mismatch is refused."""
    a: int
    """first summand"""
    b: int
    """second summand"""
    def __init__(self, a: int | None = ..., b: int | None = ...) -> None: ...

class BadTwoIntsResponse(_base.Message):
    sum: int
    """a plus b"""
    def __init__(self, sum: int | None = ...) -> None: ...

class AddTwoInts:
    """For the tutorials: adds two numbers."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[AddTwoIntsRequest]]
    _response_class: _ClassVar[type[AddTwoIntsResponse]]

class BadTwoInts:
    """For the tutorials: differs from AddTwoInts in types, and so in its md5, to show how a mismatch is refused."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[BadTwoIntsRequest]]
    _response_class: _ClassVar[type[BadTwoIntsResponse]]
