"""Types that exist only as `.idl` files."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path

import pytest

from pipros.msg.language.spec import DefinitionError
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog
from pipros_rosbag2.interfaces.idl import parse_idl
from pipros_rosbag2.interfaces.installed import installed_definitions

STATUS = """
#include "std_msgs/msg/Header.idl"
/* A comment with a "quote and a struct { */
module demo { module msg {
  typedef float Matrix[9];
  module Status_Constants {
    const uint8 LOW = 1;  // not "HIGH"
    const string NAME = "a // b" "c";
    const boolean ON = TRUE;
  };
  @verbatim (language="comment", text="a (b)" "c")
  struct Status {
    @key std_msgs::msg::Header header;
    @default (value=-1.5e-3) @unit (value="m")
    double distance, offset;
    unsigned long long count;
    string<5> word;
    sequence<sequence_of_demo::msg::Part, 3> parts;
    @default (value="(1, 2)")
    sequence<octet> bytes;
    Matrix matrix;
    wstring names[2];
  };
}; };
"""


def test_structures_have_the_fields_and_constants_of_msg_files() -> None:
    found = parse_idl(STATUS, "Status.idl")

    assert list(found) == ["demo/msg/Status"]
    assert found["demo/msg/Status"].text() == (
        'uint8 LOW=1\nstring NAME="a // bc"\nbool ON=true\n'
        "std_msgs/Header header\nfloat64 distance -1.5e-3\nfloat64 offset -1.5e-3\nuint64 count\n"
        "string<=5 word\nsequence_of_demo/Part[<=3] parts\nbyte[] bytes [1, 2]\nfloat32[9] matrix\n"
        "wstring[2] names\n"
    )


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("module a { struct B { wchar c; }; };", r"\[wchar\] is not a type that ROS 1 can express"),
        ("module a { enum B { C }; };", r"expected a definition, got \[enum\]"),
        ("module a { struct B { int8 x[0]; }; };", "a length must be a number from 1"),
        ("module a { struct B { int8 x", "the file ends within a definition"),
        ("module a { struct B { sequence<sequence<int8>> x; }; };", "arrays of arrays"),
        ("module a { struct B { int8 x = 1; }; };", r"expected ; after x, got \[=\]"),
        ("module 3 { };", r"expected a name, got \[3\]"),
    ],
)
def test_other_definitions_are_refused(text: str, reason: str) -> None:
    with pytest.raises(DefinitionError, match=reason):
        parse_idl(text, "B.idl")


def test_the_catalog_reads_messages_services_and_actions(tmp_path: Path) -> None:
    empty = "uint8 structure_needs_at_least_one_member;"
    parts = {
        "msg": "struct Go { long x; };",
        "srv": f"struct Go_Request {{ {empty} }}; struct Go_Response {{ boolean ok; }};",
        "action": f"struct Go_Goal {{ short n; }}; struct Go_Result {{ {empty} }};"
        f"struct Go_Feedback {{ {empty} }};",
    }
    for kind, text in parts.items():
        (tmp_path / "demo" / kind).mkdir(parents=True)
        (tmp_path / "demo" / kind / "Go.idl").write_text(f"module demo {{ module {kind} {{ {text} }}; }};")
    catalog = Catalog(Distribution.JAZZY, installed_definitions(), [tmp_path])

    assert catalog.message("demo/msg/Go").text() == "int32 x\n"
    assert catalog.service("demo/srv/Go").request.text() == ""
    assert catalog.service("demo/srv/Go").response.text() == "bool ok\n"
    assert catalog.action("demo/action/Go").goal.text() == "int16 n\n"
    (tmp_path / "demo" / "msg" / "Other.idl").write_text("module demo { };")
    with pytest.raises(DefinitionError, match="the file does not define demo/msg/Other"):
        catalog.message("demo/msg/Other")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('\\"' * 20_000, "a string does not end"),
        ("/* " * 20_000, None),
        ("\n" * 20_000, None),
        ("module a { " * 2_000, "modules are nested too deeply"),
        ("struct A { " + "sequence<" * 2_000, "arrays of arrays have no counterpart"),
    ],
)
def test_repeated_beginnings_are_read_in_linear_time(text: str, reason: str | None) -> None:
    before = time.process_time()
    with pytest.raises(DefinitionError, match=reason) if reason else contextlib.nullcontext():
        parse_idl(text, "Bad.idl")
    assert time.process_time() - before < 0.5
