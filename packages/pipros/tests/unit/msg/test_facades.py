"""The names that other packages import: genpy, genmsg, roslib.message."""

import importlib

import pytest
from nav_msgs.msg import Path as PathMessage
from std_srvs.srv import SetBool

import genmsg
import genmsg.msg_loader
import genmsg.msgs
import genpy
import genpy.base
import genpy.message
import genpy.rostime
import roslib.message
from tests.support.environments import SHIPPED

SEARCH = {folder.name: [str(folder / "msg")] for share in SHIPPED for folder in share.iterdir()}
SERVICES = {folder.name: [str(folder / "srv")] for share in SHIPPED for folder in share.iterdir()}


@pytest.mark.parametrize(("module", "names"), [
    ("genpy", "Message MessageException SerializationError DeserializationError Time Duration TVal struct_I"),
    ("genpy.message", "check_type fill_message_args get_message_class get_service_class strify_message"),
    ("genpy.message", "get_printable_message_args is_simple Message Time Duration TVal struct_I"),
    ("genpy.dynamic", "generate_dynamic"), ("genpy.base", "is_simple SIMPLE_TYPES"),
    ("genpy.rostime", "Time Duration TVal"), ("roslib", "load_manifest"),
    ("roslib.message", "get_message_class get_service_class strify_message Message Time Duration"),
    ("genmsg", "MsgSpec SrvSpec MsgContext MsgNotFound InvalidMsgSpec load_depends compute_md5"),
])  # fmt: skip
def test_facades_have_the_names_that_packages_import(module: str, names: str) -> None:
    found = importlib.import_module(module)
    assert [name for name in names.split() if not hasattr(found, name)] == []


def test_classes_are_found_by_name_or_none_is_returned() -> None:
    assert genpy.message.get_message_class("nav_msgs/Path") is PathMessage
    assert genpy.message.get_message_class("Header")._type == "std_msgs/Header"
    assert genpy.message.get_message_class("time") is genpy.Time
    assert genpy.message.get_service_class("std_srvs/SetBool") is SetBool
    assert genpy.message.get_message_class("nav_msgs/Nope") is None
    assert genpy.message.get_message_class("nope/Nope") is None
    with pytest.raises(ValueError, match="message type is missing package name: Path"):
        genpy.message.get_message_class("Path")
    assert roslib.message.get_message_class is genpy.message.get_message_class


def test_definitions_load_from_a_search_path_with_all_they_embed() -> None:
    context = genmsg.MsgContext.create_default()
    spec = genmsg.load_msg_by_type(context, "nav_msgs/Path", SEARCH)

    assert genmsg.load_depends(context, spec, SEARCH) == ["std_msgs/Header", "geometry_msgs/PoseStamped"]
    assert genmsg.compute_md5(context, spec) == PathMessage._md5sum
    assert genmsg.compute_full_text(context, spec) == PathMessage._full_text
    assert (spec.names, spec.types[1], spec.has_header()) == (
        ["header", "poses"], "geometry_msgs/PoseStamped[]", True,
    )  # fmt: skip
    assert context.get_all_depends("nav_msgs/Path")[:3] == [
        "std_msgs/Header", "geometry_msgs/PoseStamped", "std_msgs/Header",
    ]  # fmt: skip


def test_services_load_likewise() -> None:
    context = genmsg.MsgContext.create_default()
    spec = genmsg.load_srv_by_type(context, "std_srvs/SetBool", SERVICES)

    genmsg.load_depends(context, spec, SEARCH)

    assert genmsg.compute_md5(context, spec) == SetBool._md5sum
    assert (
        repr(spec)
        == "SrvSpec[MsgSpec[['bool'], ['data']], MsgSpec[['bool', 'string'], ['success', 'message']]]"
    )


def test_missing_and_invalid_definitions_raise_errors_of_genmsg() -> None:
    context = genmsg.MsgContext.create_default()
    with pytest.raises(genmsg.MsgNotFound, match=r"Cannot locate message \[X\]: unknown package \[nope\]"):
        genmsg.load_msg_by_type(context, "nope/X", SEARCH)
    with pytest.raises(genmsg.MsgNotFound, match=r"Cannot locate message \[X\] in package \[std_msgs\]"):
        genmsg.load_msg_by_type(context, "std_msgs/X", SEARCH)
    with pytest.raises(genmsg.InvalidMsgSpec):
        genmsg.msg_loader.load_msg_from_string(context, "int32", "p/T")


def test_names_and_types_are_split_like_genmsg() -> None:
    assert (genmsg.package_resource_name("a/b"), genmsg.package_resource_name("b")) == (("a", "b"), ("", "b"))
    with pytest.raises(ValueError, match=r"invalid name \[a/b/c\]"):
        genmsg.package_resource_name("a/b/c")
    assert genmsg.resource_name("a", "b") == "a/b"
    assert (genmsg.resource_name_base("a/b"), genmsg.resource_name_package("b")) == ("b", None)
    assert genmsg.msgs.parse_type("a/B[3]") == ("a/B", True, 3)
    assert genmsg.msgs.parse_type("int32[]") == ("int32", True, None)
    assert genmsg.msgs.resolve_type("X[]", "p") == "p/X[]"
    assert genmsg.msgs.resolve_type("Header", "p") == "std_msgs/Header"
    assert genpy.base.is_simple("float32")
    assert not genpy.base.is_simple("string")
