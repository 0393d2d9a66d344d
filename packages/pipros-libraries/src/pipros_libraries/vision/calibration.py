"""Camera calibrations as text: YAML, and the INI format of Videre Design.

As in camera_calibration_parsers, surplus values in a matrix are ignored, and a missing camera name is read as
`unknown`.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.safe import yaml_cpp
from pipros.safe.yaml import YamlError

PLUMB_BOB = "plumb_bob"
RATIONAL_POLYNOMIAL = "rational_polynomial"
_MODEL_BY_COUNT = {5: PLUMB_BOB, 8: RATIONAL_POLYNOMIAL}  # INI files do not specify the distortion model


class CalibrationError(PiprosError, ValueError):
    """The text is not a valid calibration, or the format does not support the calibration."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """A camera calibration, with the same values as `sensor_msgs/CameraInfo`.

    Attributes:
        width, height: image size in pixels.
        model: name of the distortion model.
        k, r: 3x3 matrices, row by row.
        p: 3x4 matrix, row by row.
        d: the coefficients of the distortion model.
    """

    name: str
    width: int
    height: int
    model: str
    d: tuple[float, ...]
    k: tuple[float, ...]
    r: tuple[float, ...]
    p: tuple[float, ...]


def parse(text: str, file: str) -> Calibration:
    """Parse the content of a calibration file. The suffix of `file` determines the format.

    Raises:
        CalibrationError: the suffix is not .yaml, .yml or .ini, or the text is malformed.
    """
    return {"yaml": parse_yaml, "ini": parse_ini}[_format(file)](text, file)


def formatted(calibration: Calibration, file: str) -> str:
    """Format a calibration as the content of a file. The suffix of `file` determines the format.

    Raises:
        CalibrationError: the suffix is not .yaml, .yml or .ini, or the format does not support the
            distortion model.
    """
    return {"yaml": format_yaml, "ini": format_ini}[_format(file)](calibration)


def _format(file: str) -> str:
    for ending, name in ((".yaml", "yaml"), (".yml", "yaml"), (".ini", "ini")):
        if file.endswith(ending):
            return name
    raise CalibrationError(f"a calibration file name must end with .yaml, .yml or .ini, got {file}")


def parse_yaml(text: str, file: str = "<string>") -> Calibration:
    """Parse a calibration from YAML. Values are converted as by yaml-cpp, which genuine readers use.

    Raises:
        CalibrationError: the text is malformed, or values are missing.
    """
    try:
        found = yaml_cpp.load(text, file)
    except YamlError as error:
        raise CalibrationError(str(error)) from error
    if not isinstance(found, dict):
        raise CalibrationError(f"{file}: a calibration must be a mapping, got {type(found).__name__}")
    reading = _Reading(file, found)
    return Calibration(
        name=reading.text("camera_name", "unknown"),
        width=reading.whole("image_width"),
        height=reading.whole("image_height"),
        model=reading.text("distortion_model", PLUMB_BOB),
        d=reading.matrix("distortion_coefficients"),
        k=reading.matrix("camera_matrix", (3, 3)),
        r=reading.matrix("rectification_matrix", (3, 3)),
        p=reading.matrix("projection_matrix", (3, 4)),
    )


class _Reading:
    """Reads the values in a mapping. Error texts name the key."""

    def __init__(self, file: str, values: dict[Any, Any]) -> None:
        self._file = file
        self._values = values

    def _error(self, name: str, must: str, got: Any) -> CalibrationError:
        shown = "nothing" if got is None else repr(got)[:80]
        return CalibrationError(f"{self._file}: {name} must be {must}, got {shown}")

    def text(self, name: str, default: str) -> str:
        value = self._values.get(name)
        if value is None:
            return default
        if not isinstance(value, str):
            raise self._error(name, "a string", value)
        return value

    def whole(self, name: str, values: dict[Any, Any] | None = None, place: str = "") -> int:
        value = (self._values if values is None else values).get(name)
        found = yaml_cpp.integer(value, 0, 2**32 - 1)
        if found is None:
            raise self._error(place + name, "an integer from 0 to 2**32 - 1", value)
        return found

    def matrix(self, name: str, shape: tuple[int, int] | None = None) -> tuple[float, ...]:
        values = self._values.get(name)
        if not isinstance(values, dict):
            raise self._error(name, "a mapping with rows, cols and data", values)
        got = self.whole("rows", values, f"{name}: "), self.whole("cols", values, f"{name}: ")
        if shape is not None and got != shape:
            raise self._error(name, f"a matrix of {shape[0]} rows and {shape[1]} columns", got)
        data, count = values.get("data"), got[0] * got[1]
        if not isinstance(data, list) or len(data) < count:
            raise self._error(f"{name}: data", f"a list of {count} numbers", data)
        return tuple(self._number(f"{name}: data", value) for value in data[:count])

    def _number(self, name: str, value: Any) -> float:
        found = yaml_cpp.number(value)
        if found is None:
            raise self._error(name, "numbers", value)
        return found


def format_yaml(calibration: Calibration) -> str:
    """Format a calibration as YAML in the layout of camera_calibration_parsers."""
    lines = [
        f"image_width: {calibration.width}",
        f"image_height: {calibration.height}",
        f"camera_name: {_yaml_text(calibration.name)}",
        *_yaml_matrix("camera_matrix", 3, 3, calibration.k),
        f"distortion_model: {_yaml_text(calibration.model)}",
        *_yaml_matrix("distortion_coefficients", 1, len(calibration.d), calibration.d),
        *_yaml_matrix("rectification_matrix", 3, 3, calibration.r),
        *_yaml_matrix("projection_matrix", 3, 4, calibration.p),
    ]
    return "\n".join(lines)


_PLAIN = re.compile(r"[^\W\d][\w./-]*(?: [\w./-]+){0,999}")
_YAML_WORDS = {"true", "false", "yes", "no", "on", "off", "null", "y", "n"}


def _yaml_text(text: str) -> str:
    is_plain = _PLAIN.fullmatch(text) and text.lower() not in _YAML_WORDS
    return text if is_plain else json.dumps(text, ensure_ascii=False)


def _yaml_matrix(name: str, rows: int, columns: int, values: Sequence[float]) -> list[str]:
    data = ", ".join(map(_yaml_number, values))
    return [f"{name}:", f"  rows: {rows}", f"  cols: {columns}", f"  data: [{data}]"]


def _yaml_number(value: float) -> str:
    if math.isnan(value):
        return ".nan"
    return f"{value:.17g}" if math.isfinite(value) else f"{'-' * (value < 0)}.inf"


_COMMENT = re.compile(r"#[^\n]*")
_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?(?![\w.])"
# White space is collapsed before matching, so that matching takes linear time.
_INI = re.compile(
    r" ?\[ ?image ?\] ?width ?(?P<width>\d+) height ?(?P<height>\d+) ?"
    rf"(?:\[externals\] ?translation(?: {_NUMBER}){{3}} rotation(?: {_NUMBER}){{3}} ?)?"
    r"\[(?P<name>[^\]]*)\] ?"
    rf"camera matrix(?P<k>(?: ?{_NUMBER}){{9}}) "
    rf"distortion(?P<d>(?: ?{_NUMBER})*) "
    rf"rectification(?P<r>(?: ?{_NUMBER}){{9}}) "
    rf"projection(?P<p>(?: ?{_NUMBER}){{12}})",
    re.ASCII,
)


def parse_ini(text: str, file: str = "<string>") -> Calibration:
    """Parse a calibration from Videre's INI format. Text after the projection matrix is ignored.

    Raises:
        CalibrationError: the text is malformed.
    """
    found = _INI.match(" ".join(_COMMENT.sub("", text).split()))
    if found is None or max(len(found["width"]), len(found["height"])) > 9:
        raise CalibrationError(
            f"{file}: a calibration in INI format must have [image] with width and height, then [NAME] with "
            "camera matrix, distortion, rectification and projection"
        )
    k, d, r, p = (tuple(map(float, found[part].split())) for part in "kdrp")
    name = found["name"].strip()
    width, height = int(found["width"]), int(found["height"])
    return Calibration(name, width, height, _MODEL_BY_COUNT.get(len(d), ""), d, k, r, p)


def format_ini(calibration: Calibration) -> str:
    """Format a calibration in Videre's INI format, with five decimals.

    Raises:
        CalibrationError: the distortion model is not plumb bob with five coefficients.
    """
    if calibration.model != PLUMB_BOB or len(calibration.d) != 5:
        raise CalibrationError(
            "the INI format only supports the plumb_bob distortion model with 5 coefficients, got "
            f"{calibration.model!r} with {len(calibration.d)}. Use the YAML format instead"
        )
    return (
        f"# Camera intrinsics\n\n[image]\n\nwidth\n{calibration.width}\n\nheight\n{calibration.height}\n\n"
        f"[{calibration.name}]\n\ncamera matrix\n{_ini_rows(calibration.k, 3)}\n"
        f"distortion\n{_ini_rows(calibration.d, 5)}\n\n"
        f"rectification\n{_ini_rows(calibration.r, 3)}\nprojection\n{_ini_rows(calibration.p, 4)}"
    )


def _ini_rows(values: Sequence[float], columns: int) -> str:
    rows = (values[start : start + columns] for start in range(0, len(values), columns))
    return "".join("".join(f"{value:.5f} " for value in row) + "\n" for row in rows)
