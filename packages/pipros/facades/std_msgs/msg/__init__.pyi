"""Messages of std_msgs, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
from pipros.msg import time as _time

class Bool(_base.Message):
    """A Boolean value. The topic's name says what it means. To switch something and learn whether that worked, use
    the service std_srvs/SetBool."""
    data: bool
    """true or false"""
    def __init__(self, data: bool | None = ...) -> None: ...

class Byte(_base.Message):
    """A signed 8-bit integer, with the old name byte. New interfaces use Int8 or UInt8."""
    data: int
    """from -128 to 127: in ROS 1, byte means int8"""
    def __init__(self, data: int | None = ...) -> None: ...

class ByteMultiArray(_base.Message):
    """A block of bytes as signed integers, in one dimension or many. UInt8MultiArray suits raw data better."""
    layout: MultiArrayLayout
    """the shape of the block; may be empty for a flat list"""
    @property
    def data(self) -> _Sequence[int]:
        """all elements, each from -128 to 127"""
    @data.setter
    def data(self, value: _types.Array[int]) -> None: ...
    def __init__(self, layout: MultiArrayLayout | None = ..., data: _types.Array[int] | None = ...) -> None: ...

class Char(_base.Message):
    """An unsigned 8-bit integer, with the old name char. In Python, it is a number, not a string of one letter."""
    data: int
    """from 0 to 255: in ROS 1, char means uint8"""
    def __init__(self, data: int | None = ...) -> None: ...

class ColorRGBA(_base.Message):
    """A colour with opacity. Values range from 0 to 1, not to 255. In a new message, a is 0."""
    r: float
    """red, 0 to 1"""
    g: float
    """green, 0 to 1"""
    b: float
    """blue, 0 to 1"""
    a: float
    """opacity: 0 is invisible, 1 is solid"""
    def __init__(self, r: float | None = ..., g: float | None = ..., b: float | None = ..., a: float | None = ...) -> None: ...

class Duration(_base.Message):
    """A duration."""
    data: _time.Duration
    """seconds and nanoseconds; may be negative"""
    def __init__(self, data: _time.Duration | None = ...) -> None: ...

class Empty(_base.Message):
    """A message without fields, used as a trigger. The topic's name says what it triggers."""
    def __init__(self) -> None: ...

class Float32(_base.Message):
    """A 32-bit floating-point number. The topic's name says what it is and in which unit; by REP 103
    that is an SI unit."""
    data: float
    """with about 7 digits; NaN and infinity are allowed"""
    def __init__(self, data: float | None = ...) -> None: ...

class Float32MultiArray(_base.Message):
    """A block of 32-bit floating-point numbers, in one dimension or many."""
    layout: MultiArrayLayout
    """the shape of the block; may be empty for a flat list"""
    @property
    def data(self) -> _Sequence[float]:
        """all elements, in the order that the layout defines"""
    @data.setter
    def data(self, value: _types.Array[float]) -> None: ...
    def __init__(self, layout: MultiArrayLayout | None = ..., data: _types.Array[float] | None = ...) -> None: ...

class Float64(_base.Message):
    """A 64-bit floating-point number. The topic's name says what it is and in which unit; by REP 103
    that is an SI unit."""
    data: float
    """with about 16 digits; NaN and infinity are allowed"""
    def __init__(self, data: float | None = ...) -> None: ...

class Float64MultiArray(_base.Message):
    """A block of 64-bit floating-point numbers, in one dimension or many."""
    layout: MultiArrayLayout
    """the shape of the block; may be empty for a flat list"""
    @property
    def data(self) -> _Sequence[float]:
        """all elements, in the order that the layout defines"""
    @data.setter
    def data(self, value: _types.Array[float]) -> None: ...
    def __init__(self, layout: MultiArrayLayout | None = ..., data: _types.Array[float] | None = ...) -> None: ...

class Header(_base.Message):
    """The time and the coordinate frame of a message's data, usually its first field. tf2 uses stamp and frame_id
    to transform the data to other frames."""
    seq: int
    """number of the publisher's message; publishing overwrites any value that you set"""
    stamp: _time.Time
    """the time for which the data is valid, since 1970, or in simulated time; 0: not specified"""
    frame_id: str
    """the coordinate frame of the data, such as map, odom or base_link (REP 105); no leading slash"""
    def __init__(self, seq: int | None = ..., stamp: _time.Time | None = ..., frame_id: str | None = ...) -> None: ...

class Int16(_base.Message):
    """A signed 16-bit integer. The topic's name says what it counts or measures."""
    data: int
    """from -32768 to 32767"""
    def __init__(self, data: int | None = ...) -> None: ...

class Int16MultiArray(_base.Message):
    """A block of signed 16-bit integers, in one dimension or many."""
    layout: MultiArrayLayout
    """the shape of the block; may be empty for a flat list"""
    @property
    def data(self) -> _Sequence[int]:
        """all elements, in the order that the layout defines"""
    @data.setter
    def data(self, value: _types.Array[int]) -> None: ...
    def __init__(self, layout: MultiArrayLayout | None = ..., data: _types.Array[int] | None = ...) -> None: ...

class Int32(_base.Message):
    """A signed 32-bit integer. The topic's name says what it counts or measures."""
    data: int
    """from -2147483648 to 2147483647"""
    def __init__(self, data: int | None = ...) -> None: ...

class Int32MultiArray(_base.Message):
    """A block of signed 32-bit integers, in one dimension or many."""
    layout: MultiArrayLayout
    """the shape of the block; may be empty for a flat list"""
    @property
    def data(self) -> _Sequence[int]:
        """all elements, in the order that the layout defines"""
    @data.setter
    def data(self, value: _types.Array[int]) -> None: ...
    def __init__(self, layout: MultiArrayLayout | None = ..., data: _types.Array[int] | None = ...) -> None: ...

class Int64(_base.Message):
    """A signed 64-bit integer. The topic's name says what it counts or measures."""
    data: int
    """from -9223372036854775808 to 9223372036854775807"""
    def __init__(self, data: int | None = ...) -> None: ...

class Int64MultiArray(_base.Message):
    """A block of signed 64-bit integers, in one dimension or many."""
    layout: MultiArrayLayout
    """the shape of the block; may be empty for a flat list"""
    @property
    def data(self) -> _Sequence[int]:
        """all elements, in the order that the layout defines"""
    @data.setter
    def data(self, value: _types.Array[int]) -> None: ...
    def __init__(self, layout: MultiArrayLayout | None = ..., data: _types.Array[int] | None = ...) -> None: ...

class Int8(_base.Message):
    """A signed 8-bit integer. The topic's name says what it counts or measures."""
    data: int
    """from -128 to 127"""
    def __init__(self, data: int | None = ...) -> None: ...

class Int8MultiArray(_base.Message):
    """A block of signed 8-bit integers, in one dimension or many."""
    layout: MultiArrayLayout
    """the shape of the block; may be empty for a flat list"""
    @property
    def data(self) -> _Sequence[int]:
        """all elements, in the order that the layout defines"""
    @data.setter
    def data(self, value: _types.Array[int]) -> None: ...
    def __init__(self, layout: MultiArrayLayout | None = ..., data: _types.Array[int] | None = ...) -> None: ...

class MultiArrayDimension(_base.Message):
    """One dimension in the layout of a multi-array."""
    label: str
    """a human-readable name, such as rows or channel; may be empty"""
    size: int
    """the number of steps along this dimension"""
    stride: int
    """The number of elements that the dimension spans: its size times the stride of the next inner dimension. For
    the innermost dimension, it is the size; for the outermost, the number of all elements."""
    def __init__(self, label: str | None = ..., size: int | None = ..., stride: int | None = ...) -> None: ...

class MultiArrayLayout(_base.Message):
    """How the flat data of a multi-array is divided into dimensions. With three dimensions, element (i, j, k) of
    the array is in data at the index data_offset + dim[1].stride * i + dim[2].stride * j + k."""
    dim: list[MultiArrayDimension]
    """the dimensions, the one that varies slowest first"""
    data_offset: int
    """the number of elements to skip at the beginning of data"""
    def __init__(self, dim: list[MultiArrayDimension] | None = ..., data_offset: int | None = ...) -> None: ...

class String(_base.Message):
    """A string. For values that programs read, a message with separate fields is safer than a string that must be
    parsed."""
    data: str
    """UTF-8; any length"""
    def __init__(self, data: str | None = ...) -> None: ...

class Time(_base.Message):
    """A point in time."""
    data: _time.Time
    """seconds and nanoseconds since 1970 (UTC), or in simulated time if use_sim_time is true"""
    def __init__(self, data: _time.Time | None = ...) -> None: ...

class UInt16(_base.Message):
    """An unsigned 16-bit integer. The topic's name says what it counts or measures."""
    data: int
    """from 0 to 65535"""
    def __init__(self, data: int | None = ...) -> None: ...

class UInt16MultiArray(_base.Message):
    """A block of unsigned 16-bit integers, in one dimension or many."""
    layout: MultiArrayLayout
    """the shape of the block; may be empty for a flat list"""
    @property
    def data(self) -> _Sequence[int]:
        """all elements, in the order that the layout defines"""
    @data.setter
    def data(self, value: _types.Array[int]) -> None: ...
    def __init__(self, layout: MultiArrayLayout | None = ..., data: _types.Array[int] | None = ...) -> None: ...

class UInt32(_base.Message):
    """An unsigned 32-bit integer. The topic's name says what it counts or measures."""
    data: int
    """from 0 to 4294967295"""
    def __init__(self, data: int | None = ...) -> None: ...

class UInt32MultiArray(_base.Message):
    """A block of unsigned 32-bit integers, in one dimension or many."""
    layout: MultiArrayLayout
    """the shape of the block; may be empty for a flat list"""
    @property
    def data(self) -> _Sequence[int]:
        """all elements, in the order that the layout defines"""
    @data.setter
    def data(self, value: _types.Array[int]) -> None: ...
    def __init__(self, layout: MultiArrayLayout | None = ..., data: _types.Array[int] | None = ...) -> None: ...

class UInt64(_base.Message):
    """An unsigned 64-bit integer. The topic's name says what it counts or measures."""
    data: int
    """from 0 to 18446744073709551615"""
    def __init__(self, data: int | None = ...) -> None: ...

class UInt64MultiArray(_base.Message):
    """A block of unsigned 64-bit integers, in one dimension or many."""
    layout: MultiArrayLayout
    """the shape of the block; may be empty for a flat list"""
    @property
    def data(self) -> _Sequence[int]:
        """all elements, in the order that the layout defines"""
    @data.setter
    def data(self, value: _types.Array[int]) -> None: ...
    def __init__(self, layout: MultiArrayLayout | None = ..., data: _types.Array[int] | None = ...) -> None: ...

class UInt8(_base.Message):
    """An unsigned 8-bit integer. The topic's name says what it counts or measures."""
    data: int
    """from 0 to 255"""
    def __init__(self, data: int | None = ...) -> None: ...

class UInt8MultiArray(_base.Message):
    """A block of unsigned 8-bit integers, in one dimension or many."""
    layout: MultiArrayLayout
    """the shape of the block; may be empty for a flat list"""
    @property
    def data(self) -> bytes:
        """all elements, in the order that the layout defines"""
    @data.setter
    def data(self, value: _types.Octets) -> None: ...
    def __init__(self, layout: MultiArrayLayout | None = ..., data: _types.Octets | None = ...) -> None: ...
