"""Messages of rosapi, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from pipros.msg import base as _base
from pipros.msg import stub_types as _types

class TypeDef(_base.Message):
    """Describes the fields and constants of one message type. The arrays of fields have the same order."""
    type: str
    """package/Name"""
    fieldnames: list[str]
    """of each field"""
    fieldtypes: list[str]
    """without brackets"""
    @property
    def fieldarraylen(self) -> _Sequence[int]:
        """-1: no array; 0: any length; otherwise the length"""
    @fieldarraylen.setter
    def fieldarraylen(self, value: _types.Array[int]) -> None: ...
    examples: list[str]
    """text of each field in a new message"""
    constnames: list[str]
    """of each constant"""
    constvalues: list[str]
    """text of each constant"""
    def __init__(self, type: str | None = ..., fieldnames: list[str] | None = ..., fieldtypes: list[str] | None = ..., fieldarraylen: _types.Array[int] | None = ..., examples: list[str] | None = ..., constnames: list[str] | None = ..., constvalues: list[str] | None = ...) -> None: ...
