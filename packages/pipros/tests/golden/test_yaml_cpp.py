"""Readers of files for C++ programs convert scalars as yaml-cpp does.

`yaml_cpp.json` has the answers of yaml-cpp 0.7.0 (Debian's libyaml-cpp-dev): for each text, the value of the
key `v` as each type, or null if the conversion is an error. The program that recorded it called
`YAML::Load(text)["v"].as<T>()`; "inf", "-inf" and "nan" stand for numbers that JSON lacks.
"""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from pipros.safe import yaml_cpp
from pipros.safe.yaml import YamlError
from pipros_libraries.maps.errors import MapError
from pipros_libraries.maps.map_file import read_description
from pipros_libraries.vision.calibration import CalibrationError, parse_yaml

ROWS: list[dict[str, Any]] = json.loads((Path(__file__).parent / "yaml_cpp.json").read_text("utf-8"))
LIMITS = {"int": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1)}


def value_in(text: str) -> Any:
    try:
        found = yaml_cpp.load(text)
    except YamlError:
        return None
    return found.get("v") if isinstance(found, dict) else None


@pytest.mark.parametrize("row", ROWS, ids=lambda row: repr(row["text"]))
def test_scalars_are_converted_as_by_yaml_cpp(row: dict[str, Any]) -> None:
    value = value_in(row["text"])
    expected = None if row["double"] is None else float(row["double"])
    found = yaml_cpp.number(value)
    assert found == expected or (math.isnan(found or 0.0) and math.isnan(expected or 0.0))
    for kind, limits in LIMITS.items():
        assert yaml_cpp.integer(value, *limits) == row[kind], kind
    assert (value if isinstance(value, str) else None) == row["string"]


MAP = {
    "image": "a.pgm", "resolution": "0.1", "origin": "[0, 0, 0]", "negate": "0", "occupied_thresh": "0.6",
    "free_thresh": "0.1",
}  # fmt: skip
ONE_LINE = [row for row in ROWS if row["text"].startswith("v: ") and row["text"].count("\n") == 1]


@pytest.mark.parametrize("row", ONE_LINE, ids=lambda row: repr(row["text"]))
@pytest.mark.parametrize("key", ["resolution", "negate", "free_thresh", "origin"])
def test_maps_are_read_as_by_a_program_with_yaml_cpp(tmp_path: Path, row: dict[str, Any], key: str) -> None:
    text = row["text"][3:].strip("\n")
    value = f"\n- 1\n- {text}\n- 2" if key == "origin" else text
    file = tmp_path / "map.yaml"
    file.write_text("".join(f"{name}: {each}\n" for name, each in {**MAP, key: value}.items()), "utf-8")
    expected = row["int"] if key == "negate" else row["double"]
    is_refused = expected is None or isinstance(expected, str) or (key == "resolution" and expected <= 0)
    if is_refused:  # unlike in Noetic, also numbers that are not finite, and a resolution of 0 or less
        with pytest.raises(MapError, match=f"{key}|invalid YAML"):
            read_description(str(file))
        return
    found = read_description(str(file))
    names = {"resolution": found.resolution, "negate": found.negate, "free_thresh": found.free}
    assert names.get(key, found.origin[1]) == (bool(expected) if key == "negate" else expected)


@pytest.mark.parametrize(
    ("changes", "mode", "image"),
    [
        ({"mode": "scale", "image": "7.5"}, "scale", "7.5"),
        ({"mode": "[raw]", "image": "yes"}, "trinary", "yes"),  # only a text can be invalid
        ({"origin": "[1, 2, 3, 4, x]"}, "trinary", "a.pgm"),
        ({"free_thresh": "0.1\nfree_thresh: x"}, "trinary", "a.pgm"),  # the first of equal keys counts
        ({"free_thresh": "0.1\n---\nother: document"}, "trinary", "a.pgm"),
        ({"free_thresh": "0.1 # gr\udcfc\udcdfe"}, "trinary", "a.pgm"),
    ],
)
def test_fields_of_maps_are_as_lenient_as_those_of_genuine(tmp_path, changes, mode: str, image: str) -> None:
    file = tmp_path / "map.yaml"
    text = "".join(f"{name}: {each}\n" for name, each in {**MAP, **changes}.items())
    file.write_bytes(text.encode("utf-8", "surrogateescape"))
    found = read_description(str(file))
    assert (found.mode, found.free, found.image) == (mode, 0.1, str(tmp_path / image))


CALIBRATION = """image_width: 4
image_height: 3
camera_name: a
camera_matrix: {{rows: 3, cols: 3, data: [{number}, 0, 0, 0, 1, 0, 0, 0, 1]}}
distortion_model: plumb_bob
distortion_coefficients: {{rows: 1, cols: 1, data: [0]}}
rectification_matrix: {{rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}}
projection_matrix: {{rows: 3, cols: 4, data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]}}
"""
IN_A_LIST = [row for row in ONE_LINE if not set(row["text"][3:]) & set("[]{},#")]


@pytest.mark.parametrize("row", IN_A_LIST, ids=lambda row: repr(row["text"]))
def test_calibrations_are_read_as_by_a_program_with_yaml_cpp(row: dict[str, Any]) -> None:
    text = row["text"][3:].strip("\n")
    for kind, name, good in (
        ("double", "number", CALIBRATION.format(number=text)),
        ("uint32", "image_width", CALIBRATION.format(number="1").replace("width: 4", f"width: {text}")),
        ("string", "camera_name", CALIBRATION.format(number="1").replace("name: a", f"name: {text}")),
    ):
        if row[kind] is None:
            with pytest.raises(CalibrationError):
                parse_yaml(good)
            continue
        found = parse_yaml(good)
        values = {"number": found.k[0], "image_width": found.width, "camera_name": found.name}
        expected = float(row[kind]) if kind == "double" else row[kind]
        assert values[name] == expected or (expected != expected and values[name] != values[name])
