"""`numpy_msg`, which creates message classes that receive arrays of numbers as numpy arrays."""

from __future__ import annotations

from functools import cache
from typing import Any

from pipros.basics.extras import required
from pipros.basics.lazy_names import star_names as _star_names
from pipros.node.codec import AnyMessage

_star_names(__name__, "numpy")


def numpy_msg(msg_type: type[AnyMessage]) -> type[AnyMessage]:
    """Return the class to publish or subscribe with, instead of `msg_type`.

    Calls with the same type return the same class.

    Both classes can publish numpy arrays, but only the returned class receives them.

    >>> rospy.Subscriber("floats", numpy_msg(Float32MultiArray), callback)       # doctest: +SKIP
    """
    key: Any = msg_type
    return _class_of(key)


@cache
def _class_of(msg_type: type[Any]) -> type[Any]:
    numpy = required("numpy", "numpy_msg needs numpy", "numpy")

    def from_bytes(cls: type[Any], data: bytes | memoryview) -> Any:
        return cls().deserialize_numpy(bytes(data), numpy)  # the arrays refer to the copy, and keep it alive

    def deserialize(self: Any, str: bytes) -> Any:  # noqa: A002  # genpy's name for it
        return self.deserialize_numpy(bytes(str), numpy)

    members: dict[str, Any] = {
        "__slots__": msg_type.__slots__,
        "__doc__": msg_type.__doc__,
        "_from_bytes": classmethod(from_bytes),
        "deserialize": deserialize,
        "_has_numpy_arrays": True,  # for subscribers with zero_copy
    }
    for name in ("_type", "_md5sum", "_full_text", "_has_header", "_slot_types"):
        members[name] = getattr(msg_type, name)
    return type(f"Numpy_{msg_type._type.replace('/', '__')}", (msg_type,), members)
