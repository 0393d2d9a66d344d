"""Private parameters are converted as in roscpp, by every reader.

`roscpp_parameters.json` has the answers of `NodeHandle::param` of roscpp 1.15.15: for each value, the result
for each type, or null if the default applies. Where roscpp returns the smallest integer for a number that is
not an integer of 32 bits, the default applies here.
"""

import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pipros_libraries.nodes.params import (
    InvalidParameter,
    PrivateParameters,
    converted,
    converted_list,
    private,
)
from pipros_libraries.reconfiguring.server import Setting
from pipros_robot.perception.laser.filters.base import FilterHost, ScanFilter

ROWS: list[dict[str, Any]] = json.loads(
    (Path(__file__).parent / "roscpp_parameters.json").read_text(), parse_int=int
)
DEFAULTS: dict[str, Any] = {"int": 99, "double": 99.5, "bool": True, "string": "?"}
KINDS = {"ints": int, "doubles": float, "bools": bool, "strings": str}
SMALLEST = -(2**31)


def value_of(row: dict[str, Any]) -> Any:
    value = row["value"]
    return float(value["float"]) if isinstance(value, dict) and "float" in value else value


def expected_of(row: dict[str, Any], kind: str) -> Any:
    """Return what roscpp returns, or the default."""
    found = row[kind]
    if found is None or (kind == "int" and found == SMALLEST and value_of(row) != SMALLEST):
        return DEFAULTS[kind]
    return type(DEFAULTS[kind])(found)


def same(one: Any, other: Any) -> bool:
    both_nan = isinstance(one, float) and isinstance(other, float) and math.isnan(one) and math.isnan(other)
    return type(one) is type(other) and (both_nan or one == other)


def by_private(value: Any, default: Any) -> Any:
    node: Any = SimpleNamespace(params=SimpleNamespace(get=lambda _: value))
    return private(node, "name", default)


def by_navigation(value: Any, default: Any) -> Any:
    given = PrivateParameters({"name": value})
    readers: dict[type, Any] = {
        int: given.integer, float: given.number, bool: given.boolean, str: given.text,
    }  # fmt: skip
    return readers[type(default)]("name", default)


def by_filter(value: Any, default: Any) -> Any:
    kind = type("Filter", (ScanFilter,), {"settings": (Setting("name", default),)})
    return kind("filter", {"name": value}, FilterHost()).values["name"]


def by_setting(value: Any, default: Any) -> Any:
    return Setting("name", default).read(value)


@pytest.mark.parametrize("read", [by_private, by_navigation, by_filter, by_setting])
@pytest.mark.parametrize("row", ROWS, ids=lambda row: json.dumps(row["value"]))
def test_every_reader_converts_as_roscpp_does(row: dict[str, Any], read: Any) -> None:
    value = value_of(row)
    for kind, default in DEFAULTS.items():
        expected = expected_of(row, kind)
        if read is by_setting and type(value) is float and kind in ("int", "double"):
            expected = default if math.isnan(value) else expected
            if kind == "int" and abs(value) > 2**31 - 1:  # a setting has bounds
                expected = 2**31 - 1 if value > 0 else -(2**31)
        if read is by_navigation and type(expected) is float and not math.isfinite(expected):
            with pytest.raises(InvalidParameter, match="~name must be a finite number"):  # it has no meaning
                read(value, default)
            continue
        assert same(read(value, default), expected), kind


@pytest.mark.parametrize("row", ROWS, ids=lambda row: json.dumps(row["value"]))
def test_lists_are_converted_as_in_roscpp(row: dict[str, Any]) -> None:
    value = value_of(row)
    for name, kind in KINDS.items():
        expected = row[name]
        assert converted_list(value, kind) == expected, name
        assert expected is None or all(type(each) is kind for each in converted_list(value, kind) or [])
    if row["doubles"]:
        assert PrivateParameters({"name": value}).numbers("name", len(value), ()) == tuple(row["doubles"])
    else:
        with pytest.raises(InvalidParameter, match="~name must be a list of 2 numbers"):
            PrivateParameters({"name": value}).numbers("name", 2, ())


def test_values_that_roscpp_never_gets_are_not_converted() -> None:
    assert converted(2**40, int) is None
    assert converted_list([math.inf], int) is None
