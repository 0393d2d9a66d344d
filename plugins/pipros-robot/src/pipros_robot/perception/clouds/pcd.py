"""Point cloud files (PCD, version 0.7) as bytes: ascii, binary and binary_compressed.

See https://pointclouds.org/documentation/tutorials/pcd_file_format.html. A field named `_` is padding.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros_libraries.transforms.pose import IDENTITY, Pose
from pipros_robot.perception.clouds.points import CODES, FLOAT32, TYPES, rows_of
from pipros_robot.perception.extras import numpy as np

if TYPE_CHECKING:
    from sensor_msgs.msg import PointCloud2, PointField

    from pipros_libraries.vision.extras import Array

MODES: Final = ("ascii", "binary", "binary_compressed")

_HEADER_BYTES: Final = 65_536
_POINTS: Final = 100_000_000
_COUNT: Final = 100_000
_KINDS: Final = {"F": "f", "I": "i", "U": "u"}


class InvalidPcd(PiprosError, ValueError):
    """The data is not a valid PCD file. The text says why."""


@dataclass(frozen=True, slots=True)
class Header:
    """The contents of a file's header.

    Attributes:
        fields: the name, numpy type and number of elements of each field.
        viewpoint: the pose of the sensor.
    """

    fields: tuple[tuple[str, Any, int], ...]
    width: int
    height: int
    viewpoint: Pose
    mode: str

    @property
    def point_step(self) -> int:
        return sum(kind.itemsize * count for _, kind, count in self.fields)


def parse(data: bytes) -> tuple[PointCloud2, Pose]:
    """Return the cloud in a file, without a frame ID or timestamp, and the pose of the sensor.

    Raises:
        InvalidPcd: the data is malformed, or shorter than the header specifies.
    """
    header, body = _read_header(data)
    count, step = header.width * header.height, header.point_step
    if header.mode == "ascii":
        rows = _from_text(body, header)
    elif header.mode == "binary":
        if len(body) < count * step:
            raise InvalidPcd(
                f"a file with {count} points must have {count * step} bytes of data, got {len(body)}"
            )
        rows = np.frombuffer(body, np.uint8, count * step).reshape(count, step)
    else:
        rows = _from_columns(_decompressed(body, count * step), header)
    field_class: type[PointField] = load_message_class("sensor_msgs/PointField")
    cloud: PointCloud2 = load_message_class("sensor_msgs/PointCloud2")()
    offset = 0
    for name, kind, elements in header.fields:
        if name != "_":
            cloud.fields.append(field_class(name, offset, CODES[kind.str[1:]], elements))
        offset += kind.itemsize * elements
    cloud.height, cloud.width, cloud.point_step = header.height, header.width, step
    cloud.row_step, cloud.data = step * header.width, np.ascontiguousarray(rows).reshape(-1)
    cloud.is_dense = bool(_are_finite(rows, header))
    return cloud, header.viewpoint


def _are_finite(rows: Array, header: Header) -> bool:
    offset = 0
    for _, kind, count in header.fields:
        end = offset + kind.itemsize * count
        if kind.kind == "f" and not np.isfinite(np.ascontiguousarray(rows[:, offset:end]).view(kind)).all():
            return False
        offset = end
    return True


def _read_header(data: bytes) -> tuple[Header, memoryview]:
    values: dict[str, list[str]] = {}
    start = 0
    while "DATA" not in values:
        end = data.find(b"\n", start, start + _HEADER_BYTES)
        if end < 0 or start > _HEADER_BYTES:
            raise InvalidPcd("the header must end with a DATA line")
        words = data[start:end].decode("ascii", "replace").split()
        if words and not words[0].startswith("#"):
            values[words[0]] = words[1:]
        start = end + 1
    try:
        names, sizes, types = (values[key] for key in ("FIELDS", "SIZE", "TYPE"))
        counts = list(map(int, values.get("COUNT", ["1"] * len(names))))
        kinds = [np.dtype(f"<{_KINDS[kind]}{int(size)}") for kind, size in zip(types, sizes, strict=True)]
        fields = tuple(zip(names, kinds, counts, strict=True))
        width = int(values["WIDTH"][0])
        height = int(values["HEIGHT"][0]) if "HEIGHT" in values else 1
        px, py, pz, qw, qx, qy, qz = map(float, values.get("VIEWPOINT", ["0", "0", "0", "1", "0", "0", "0"]))
        mode = values["DATA"][0]
    except (KeyError, ValueError, IndexError, TypeError) as error:
        raise InvalidPcd(f"the header is malformed: {type(error).__name__}: {error}") from error
    if mode not in MODES:
        raise InvalidPcd(f"DATA must be one of {', '.join(MODES)}, got {mode}")
    if any(kind.str[1:] not in CODES or not 0 < count <= _COUNT for _, kind, count in fields):
        raise InvalidPcd(
            f"SIZE and TYPE must describe numbers, and COUNT must be 1 to {_COUNT}, "
            f"got {sizes}, {types}, {counts}"
        )
    if width < 0 or height < 0 or width * height > _POINTS:
        raise InvalidPcd(f"WIDTH x HEIGHT must be 0 to {_POINTS} points, got {width} x {height}")
    return Header(fields, width, height, (px, py, pz, qx, qy, qz, qw), mode), memoryview(data)[start:]


def _layout(header: Header) -> Any:
    return np.dtype([(f"f{at}", kind, (n,)) for at, (_, kind, n) in enumerate(header.fields)])


def _from_text(body: memoryview, header: Header) -> Array:
    count, width = header.width * header.height, sum(elements for _, _, elements in header.fields)
    words = bytes(body).split()
    if len(words) < count * width:
        raise InvalidPcd(f"a file with {count} points must have {count * width} values, got {len(words)}")
    table = np.array(words[: count * width], object).reshape(count, width)
    points = np.zeros(count, _layout(header))
    at = 0
    for index, (_, kind, elements) in enumerate(header.fields):
        try:
            cells = table[:, at : at + elements]
            if kind.kind == "f":
                points[f"f{index}"] = cells.astype(np.float64)
            else:
                numbers, limits = list(map(int, cells.reshape(-1))), np.iinfo(kind)
                if numbers and not limits.min <= min(numbers) <= max(numbers) <= limits.max:
                    raise ValueError(
                        f"must be {limits.min} to {limits.max}, got {min(numbers)} to {max(numbers)}"
                    )
                points[f"f{index}"] = np.array(numbers, kind).reshape(cells.shape)
        except (ValueError, OverflowError) as error:
            raise InvalidPcd(f"a value of field {header.fields[index][0]} is invalid: {error}") from error
        at += elements
    return points.view(np.uint8).reshape(count, header.point_step)


def _from_columns(data: bytes, header: Header) -> Array:
    """Convert the values of a compressed file, which are stored field by field, to rows of points."""
    count = header.width * header.height
    points, at = np.zeros(count, _layout(header)), 0
    for index, (_, kind, elements) in enumerate(header.fields):
        points[f"f{index}"] = np.frombuffer(data, kind, count * elements, at).reshape(count, elements)
        at += count * elements * kind.itemsize
    return points.view(np.uint8).reshape(count, header.point_step)


def _decompressed(body: memoryview, size: int) -> bytes:
    """Decompress LZF data, which is preceded by its compressed and uncompressed sizes.

    The LZF library is not used, because PyPI has no wheel for it.
    """
    packed = int.from_bytes(body[:4], "little")
    if len(body) < 8 + packed or int.from_bytes(body[4:8], "little") != size:
        raise InvalidPcd(f"the compressed data must be complete and decompress to {size} bytes")
    source, found, at = bytes(body[8 : 8 + packed]), bytearray(), 0
    try:
        while at < packed and len(found) <= size:
            control = source[at]
            if control < 32:
                found += source[at + 1 : at + 2 + control]
                at += 2 + control
                continue
            length, at = control >> 5, at + 1
            if length == 7:
                length, at = length + source[at], at + 1
            start = len(found) - ((control & 31) << 8) - source[at] - 1
            length, at = length + 2, at + 1
            if start < 0:
                raise InvalidPcd("the compressed data is malformed")
            while length > 0:
                part = found[start : start + length]
                found += part
                start, length = start + len(part), length - len(part)
    except IndexError as error:
        raise InvalidPcd("the compressed data is malformed") from error
    if len(found) != size:
        raise InvalidPcd(f"the compressed data must decompress to {size} bytes, got {len(found)}")
    return bytes(found)


def _compressed(data: bytes) -> bytes:
    """Encode data as LZF literals. Every LZF reader accepts the result, which is larger than the input."""
    whole = len(data) // 32
    blocks = np.full((whole, 33), 31, np.uint8)
    blocks[:, 1:] = np.frombuffer(data, np.uint8, whole * 32).reshape(whole, 32)
    rest = data[whole * 32 :]
    return blocks.tobytes() + (bytes([len(rest) - 1]) + rest if rest else b"")


def formatted(cloud: PointCloud2, mode: str = "ascii", viewpoint: Pose = IDENTITY) -> bytes:
    """Return the contents of a PCD file for a cloud. Bytes outside the cloud's fields are omitted.

    Raises:
        InvalidCloud: the size of the data does not match the cloud's dimensions.
    """
    rows = rows_of(cloud)
    columns: list[tuple[str, Array]] = []
    for field in sorted(cloud.fields, key=lambda each: each.offset):
        count = max(field.count, 1)
        kind = np.dtype(TYPES.get(field.datatype, "u1"))
        part = rows[:, field.offset : field.offset + kind.itemsize * count]
        if part.shape[1] == kind.itemsize * count:
            stored = kind.newbyteorder(">" if cloud.is_bigendian else "<")
            values = np.ascontiguousarray(part).view(stored).astype(kind)
            if mode == "ascii" and field.name == "rgb" and field.datatype == FLOAT32:
                values = values.view(np.uint32)
            columns.append((field.name, values))
    header = _header_text(cloud, columns, viewpoint, mode)
    if mode == "ascii":
        text = io.StringIO()
        cells = [
            f"{{:{'.8g' if v.dtype.kind == 'f' else ''}}}" for _, v in columns for _ in range(v.shape[1])
        ]
        line = " ".join(cells) + "\n"
        for row in zip(*(column for _, v in columns for column in v.T.tolist()), strict=True):
            text.write(line.format(*row))
        return header + text.getvalue().encode()
    if mode == "binary":
        points = np.zeros(len(rows), [(f"f{at}", v.dtype, v.shape[1:]) for at, (_, v) in enumerate(columns)])
        for at, (_, values) in enumerate(columns):
            points[f"f{at}"] = values
        return header + points.tobytes()
    joined = b"".join(values.tobytes() for _, values in columns)
    packed = _compressed(joined)
    return header + len(packed).to_bytes(4, "little") + len(joined).to_bytes(4, "little") + packed


def _header_text(
    cloud: PointCloud2, columns: Sequence[tuple[str, Array]], viewpoint: Pose, mode: str
) -> bytes:
    px, py, pz, qx, qy, qz, qw = (f"{each:g}" for each in viewpoint)
    kinds = [values.dtype for _, values in columns]
    lines = (
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        " ".join(["FIELDS", *(name for name, _ in columns)]),
        " ".join(["SIZE", *(str(kind.itemsize) for kind in kinds)]),
        " ".join(["TYPE", *(kind.kind.upper() for kind in kinds)]),
        " ".join(["COUNT", *(str(values.shape[1]) for _, values in columns)]),
        f"WIDTH {cloud.width}",
        f"HEIGHT {cloud.height}",
        f"VIEWPOINT {px} {py} {pz} {qw} {qx} {qy} {qz}",
        f"POINTS {cloud.width * cloud.height}",
        f"DATA {mode}\n",
    )
    return "\n".join(lines).encode()
