"""Messages of uuid_msgs, made from their definitions by `pipros stubs`."""

from pipros.msg import base as _base
from pipros.msg import stub_types as _types

class UniqueID(_base.Message):
    """A universally unique identifier (RFC 4122)."""
    @property
    def uuid(self) -> bytes:
        """the most significant byte first"""
    @uuid.setter
    def uuid(self, value: _types.Octets) -> None: ...
    def __init__(self, uuid: _types.Octets | None = ...) -> None: ...
