"""Conversion between ROS 1 and CDR: results equal those of rosbags; rules decide which fields match."""

import io
import struct
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.errors import NotFound
from pipros.msg import load_message_class
from pipros.msg.language.parse import parse_message, parse_service
from pipros.msg.language.spec import DefinitionError
from pipros.msg.time import Duration, Time
from pipros_rosbag2.conversion.errors import BoundExceeded, ConversionError, InvalidRules, NotConvertible
from pipros_rosbag2.conversion.mapping import BUILTIN_RULES, MappingRules, merged, parse_rules
from pipros_rosbag2.conversion.plans import ConversionPlan, Plans
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog, Ros1Definitions
from pipros_rosbag2.interfaces.parse import parse_ros2_message
from tests.support.ros2_samples import Samples, differences, plans_of, shared_types

U32 = struct.Struct("<I")


def serialized(message: Any) -> bytes:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


@pytest.mark.parametrize("distribution", Distribution)
def test_all_shared_types_equal_rosbags(distribution: Distribution) -> None:
    assert len(shared_types(distribution)) == (115 if distribution is Distribution.LYRICAL else 119)
    assert list(differences(distribution, 3)) == []


def test_every_shorter_message_raises() -> None:
    samples, plans = Samples(Distribution.JAZZY, seed=2), plans_of(Distribution.JAZZY)
    for name in ("std_msgs/msg/Header", "sensor_msgs/msg/JointState", "visualization_msgs/msg/Marker"):
        plan, (ros1, cdr) = plans.for_ros2(name), samples.pair(name)
        for size in range(len(ros1)):
            with pytest.raises(ConversionError):
                plan.to_cdr(ros1[:size])
        for size in range(len(cdr)):
            with pytest.raises(ConversionError):
                plan.to_ros1(cdr[:size])


def test_up_to_three_bytes_of_padding_are_accepted() -> None:
    plan = plans_of(Distribution.JAZZY).for_ros1("std_msgs/String")
    cdr = plan.to_cdr(b"\2\0\0\0hi")

    assert (cdr.hex(), plan.to_ros1(cdr + bytes(3))) == ("0001000003000000686900", b"\2\0\0\0hi")
    with pytest.raises(ConversionError, match="at most 3 of padding"):
        plan.to_ros1(cdr + bytes(4))


@pytest.mark.parametrize(("cdr", "reason"), [
    (b"", "the header of no bytes"), (b"\0\0\0\0\0\0\0\2h\0", "big-endian CDR"), (b"\0\3\0\0", "PL_CDR"),
    (b"\0\7\0\0", "0007"), (b"\0\1\0\0\2\0\0\0hi", "must end with a zero byte"),
    (b"\0\1\0\0\xff\xff\xff\xffhi", "too short"),
])  # fmt: skip
def test_other_bytes_raise(cdr: bytes, reason: str) -> None:
    with pytest.raises(ConversionError, match=f"std_msgs/msg/String: .*{reason}"):
        plans_of(Distribution.JAZZY).for_ros1("std_msgs/String").to_ros1(cdr)


def test_a_string_without_its_zero_byte_may_have_no_bytes() -> None:
    assert plans_of(Distribution.JAZZY).for_ros1("std_msgs/String").to_ros1(b"\0\1\0\0\0\0\0\0") == bytes(4)


def test_strings_pass_as_bytes() -> None:
    plan = plans_of(Distribution.JAZZY).for_ros1("std_msgs/String")

    assert plan.to_ros1(plan.to_cdr(b"\2\0\0\0\xff\xfe")) == b"\2\0\0\0\xff\xfe"


@pytest.mark.parametrize(("ros1", "ros2", "back"), [
    ((5, -1), (4, 999_999_999), (4, 999_999_999)), ((-1, -500_000_000), (-2, 500_000_000), (-2, 500_000_000)),
    ((1, 5), (1, 5), (1, 5)), ((7, -2_000_000_000), (5, 0), (5, 0)),
])  # fmt: skip
def test_negative_nanoseconds_of_durations_are_carried(ros1: Any, ros2: Any, back: Any) -> None:
    plan = plans_of(Distribution.JAZZY).for_ros1("std_msgs/Duration")

    cdr = plan.to_cdr(struct.pack("<ii", *ros1))

    assert plan.ros2_type == "builtin_interfaces/msg/Duration"
    assert cdr == b"\0\1\0\0" + struct.pack("<iI", *ros2)
    assert plan.to_ros1(cdr) == struct.pack("<ii", *back)


def test_large_nanoseconds_of_durations_are_carried() -> None:
    plan = plans_of(Distribution.JAZZY).for_ros1("std_msgs/Duration")

    assert plan.to_ros1(b"\0\1\0\0" + struct.pack("<iI", 1, 4_000_000_005)) == struct.pack("<ii", 5, 5)


def test_times_beyond_the_range_of_the_other_side_are_clamped() -> None:
    plan = plans_of(Distribution.JAZZY).for_ros1("std_msgs/Time")

    assert plan.to_cdr(struct.pack("<II", 1 << 31, 7))[4:] == struct.pack("<iI", (1 << 31) - 1, 7)
    assert plan.to_ros1(b"\0\1\0\0" + struct.pack("<iI", -1, 7)) == bytes(8)
    assert plan.to_ros1(b"\0\1\0\0" + struct.pack("<iI", 4, 7)) == struct.pack("<II", 4, 7)


def test_clamping_leaves_the_bytes_of_the_caller() -> None:
    plan = plans_of(Distribution.JAZZY).for_ros1("tf2_msgs/TFMessage")
    cls = load_message_class("tf2_msgs/TFMessage")
    transform = load_message_class("geometry_msgs/TransformStamped")
    message = cls(transforms=[transform(), transform()])  # type: ignore[call-arg]
    for each in message.transforms:  # type: ignore[attr-defined]
        each.header.stamp = Time((1 << 32) - 1, 5)
    data = bytearray(serialized(message))
    before = bytes(data)

    back = cls._from_bytes(plan.to_ros1(plan.to_cdr(data)))

    assert bytes(data) == before
    assert [each.header.stamp.secs for each in back.transforms] == [(1 << 31) - 1] * 2  # type: ignore[attr-defined]


def test_log_entries_change_their_levels() -> None:
    plan = plans_of(Distribution.JAZZY).for_ros1("rosgraph_msgs/Log")
    cls: Any = load_message_class("rosgraph_msgs/Log")
    message = cls(level=4, name="/node", msg="text", file="f", function="g", line=12, topics=["/a"])
    message.header.stamp = Time(3, 4)
    message.header.frame_id = "lost"

    cdr = plan.to_cdr(serialized(message))
    back: Any = cls._from_bytes(plan.to_ros1(cdr))

    assert (plan.ros2_type, plan.only_ros1) == ("rcl_interfaces/msg/Log", ("topics",))
    assert cdr[4:13] == struct.pack("<iIB", 3, 4, 30)
    assert (back.level, back.header.stamp, back.topics, back.line) == (4, Time(3, 4), [], 12)
    assert plans_of(Distribution.JAZZY).for_ros2("rcl_interfaces/msg/Log") is plan


def test_a_bound_that_is_exceeded_raises() -> None:
    plan = plans_of(Distribution.JAZZY).for_ros1("shape_msgs/SolidPrimitive")
    cls: Any = load_message_class("shape_msgs/SolidPrimitive")

    assert plan.to_ros1(plan.to_cdr(serialized(cls(dimensions=[1, 2, 3])))) == serialized(
        cls(dimensions=[1, 2, 3])
    )
    with pytest.raises(BoundExceeded, match="length of 4, but ROS 2 allows at most 3"):
        plan.to_cdr(serialized(cls(dimensions=[1, 2, 3, 4])))


def test_large_arrays_are_not_copied() -> None:
    cls: Any = load_message_class("sensor_msgs/Image")
    plan = plans_of(Distribution.JAZZY).for_ros1("sensor_msgs/Image")
    data = serialized(cls(data=bytes(100_000)))

    assert max(len(part) for part in plan.to_cdr_parts(data) if isinstance(part, memoryview)) == 100_000


# Definitions of the tests ---------------------------------------------------------------------------------


def plan_between(ros1: str, ros2: str, rules: MappingRules = BUILTIN_RULES, **others: str) -> ConversionPlan:
    """Return the plan between `a_msgs/A` and `a_msgs/msg/A`. `others` are types of both languages."""
    theirs = {"A": ros2, **others}

    def lookup(name: str) -> Any:
        if not name.startswith("a_msgs/"):
            raise NotFound(name)
        return parse_message({"A": ros1, **others}[name.removeprefix("a_msgs/")], name)

    definitions = Ros1Definitions(lookup, lookup)
    catalog = Catalog(Distribution.JAZZY, definitions)
    catalog.add(
        {
            f"a_msgs/msg/{name}": parse_ros2_message(text, f"a_msgs/msg/{name}")
            for name, text in theirs.items()
        }
    )
    return Plans(catalog, definitions, rules).for_ros1("a_msgs/A")


def test_added_fields_have_the_defaults_of_the_definition() -> None:
    plan = plan_between(
        "int8 x", 'int8 x\nint32 y 7\nstring s "ab"\nfloat64[2] z [1, 2]\nuint8[] b [1, 2]\nbool t true'
    )

    cdr = plan.to_cdr(b"\1")

    assert plan.only_ros2 == ("y", "s", "z", "b", "t")
    body = b"\1\0\0\0" + U32.pack(7) + U32.pack(3) + b"ab\0\0" + struct.pack("<dd", 1, 2) + b"\2\0\0\0\1\2\1"
    assert cdr[4:].hex() == body.hex()
    assert plan.to_ros1(cdr) == b"\1"


def test_fields_of_one_side_are_skipped() -> None:
    extra = "B[2] p\nstring[] q\nfloat64[] r\nint64[3] s\n%sstring w%s\nB t\nint16 y"
    plan = plan_between("int8 x\nint16 y", "int8 x\n" + extra % ("w", ' "w𝄞"'), B="string a\nfloat64 b")
    back = plan_between("int8 x\n" + extra % ("", ""), "int8 x\nint16 y", B="string a\nfloat64 b")

    assert plan.to_ros1(plan.to_cdr(b"\5\6\7")) == b"\5\6\7"
    assert back.to_cdr(back.to_ros1(b"\0\1\0\0\5\0\6\7")) == b"\0\1\0\0\5\0\6\7"


def test_fields_may_have_another_order() -> None:
    plan = plan_between("string a\nfloat64 b\nint8[] c", "int8[] c\nstring a\nfloat64 b")
    data = U32.pack(2) + b"hi" + struct.pack("<d", 0.5) + U32.pack(1) + b"\7"

    cdr = plan.to_cdr(data)

    assert cdr[4:].hex() == (b"\1\0\0\0\7\0\0\0\3\0\0\0hi\0" + bytes(1) + struct.pack("<d", 0.5)).hex()
    assert plan.to_ros1(cdr) == data


RULES = """
- ros1_package_name: a_msgs
  ros1_message_name: A
  ros2_package_name: a_msgs
  ros2_message_name: A
  fields_1_to_2:
    x: b.y
    b.s: t
"""


def test_rules_name_fields_of_embedded_messages() -> None:
    rules = merged([parse_rules(RULES, "rules.yaml")])
    plan = plan_between("int32 lost\nB b\nint16 x", "string t\nB b", rules, B="string s\nint16 y")

    cdr = plan.to_cdr(U32.pack(9) + U32.pack(1) + b"q" + b"\1\2" + b"\5\6")

    assert cdr[4:].hex() == (U32.pack(2) + b"q\0" + bytes(2) + U32.pack(1) + b"\0" + bytes(1) + b"\5\6").hex()
    assert plan.to_ros1(cdr) == bytes(4) + U32.pack(1) + b"q" + bytes(2) + b"\5\6"


@pytest.mark.parametrize("name", ["x: b.z", "nothing: t"])
def test_a_rule_with_an_unknown_field_raises(name: str) -> None:
    rules = merged([parse_rules(RULES.replace("x: b.y", name), "rules.yaml")])
    plan = plan_between("B b\nint16 x", "string t\nB b", rules, B="string s\nint16 y")

    with pytest.raises(NotConvertible, match="which does not exist"):
        plan.prepare()


@pytest.mark.parametrize(("ros1", "ros2", "reason"), [
    ("int8 a", "int8 b", "only ROS 1 has a, only ROS 2 has b"),
    ("int8 a", "int16 a", "numbers of 1 and 2 bytes"),
    ("float32 a", "int32 a", "one floating-point number and one integer"),
    ("int8[3] a", "int8[4] a", "an array of 3 integers and an array of 4 integers"),
    ("int8[] a", "int8 a", "a sequence of integers and one integer"),
    ("string a", "wstring a", "one string and one wide string"),
])  # fmt: skip
def test_types_that_do_not_correspond_raise(ros1: str, ros2: str, reason: str) -> None:
    with pytest.raises(NotConvertible, match=reason):
        plan_between(ros1, ros2).prepare()


def test_elements_without_bytes_are_limited() -> None:
    plan = plan_between("B[] b", "B[] b", B="")

    assert plan.to_cdr(U32.pack(3)) == b"\0\1\0\0" + U32.pack(3) + bytes(3)
    assert plan.to_ros1(plan.to_cdr(U32.pack(3))) == U32.pack(3)
    with pytest.raises(ConversionError, match="65536 are allowed"):
        plan.to_cdr(U32.pack(1 << 31))


def test_a_claimed_length_allocates_nothing() -> None:
    plan = plan_between("string[] a", "string[] a")

    with pytest.raises(ConversionError, match="an array of 2147483648 elements is longer than the data"):
        plan.to_cdr(U32.pack(1 << 31))


def test_aligned_elements_are_one_slice() -> None:
    plan = plan_between(
        "int8 a\nB[] b\nint8 c\nB[1] d", "int8 a\nB[] b\nint8 c\nB[1] d", B="float64 x\nint32 y\nint32 z"
    )
    element = struct.pack("<dii", 1, 2, 3)
    data = b"\1" + U32.pack(2) + element * 2 + b"\2" + element

    cdr = plan.to_cdr(data)

    assert cdr[4:].hex() == (b"\1\0\0\0\2\0\0\0" + element * 2 + b"\2" + bytes(7) + element).hex()
    assert plan.to_ros1(cdr) == data
    assert (
        plan.to_ros1(plan.to_cdr(b"\1" + U32.pack(0) + b"\2" + element))
        == b"\1" + U32.pack(0) + b"\2" + element
    )


def test_deeply_nested_arrays_have_small_code() -> None:
    names = [f"L{number}" for number in range(12)]
    texts = {name: f"{inner}[] a\nint8 c" for name, inner in pairwise([*names, "Point"])}
    plan = plan_between("L0[] x", "L0[] x", **texts, Point="float64 x")
    message = U32.pack(1) * 13 + struct.pack("<d", 0.5) + bytes(range(12))

    assert plan.to_ros1(plan.to_cdr(message)) == message


def test_default_values_are_limited() -> None:
    names = [f"L{number}" for number in range(12)]
    texts = {
        name: "".join(f"{inner} {x}\n" for x in "abcdefgh") for name, inner in pairwise([*names, "Point"])
    }

    with pytest.raises(DefinitionError, match="definition_fields"):
        plan_between("int8 y", "int8 y\nL0 x", **texts, Point="float64 x").prepare()
    large = plan_between("int8 y", "int8 y\nfloat64[100000] x")
    assert large.to_cdr(b"\1") == b"\0\1\0\0\1" + bytes(7 + 800_000)


def test_services_have_two_plans() -> None:
    plan = plans_of(Distribution.JAZZY).service("std_srvs/SetBool")

    assert plan.ros2_type == "std_srvs/srv/SetBool"
    assert plan.request.to_cdr(b"\1") == b"\0\1\0\0\1"
    assert plan.response.to_ros1(plan.response.to_cdr(b"\1\2\0\0\0ok")) == b"\1\2\0\0\0ok"
    assert plans_of(Distribution.JAZZY).service("std_srvs/Empty").request.to_cdr(b"") == b"\0\1\0\0\0"


@pytest.mark.parametrize("name", ["roscpp_tutorials/TwoInts", "rospy_tutorials/AddTwoInts"])
def test_the_services_of_the_tutorials_correspond(name: str) -> None:
    plan = plans_of(Distribution.JAZZY).service(name)

    assert plan.ros2_type == "example_interfaces/srv/AddTwoInts"
    assert plan.request.to_cdr(struct.pack("<qq", 1, 2)) == b"\0\1\0\0" + struct.pack("<qq", 1, 2)


SERVICE_RULES = """
- {ros1_package_name: a_msgs, ros2_package_name: b_interfaces}
- ros1_package_name: a_msgs
  ros1_service_name: S
  ros2_package_name: b_interfaces
  ros2_service_name: T
  request_fields_1_to_2: {x: y}
  response_fields_1_to_2: {}
"""


def test_rules_for_services_and_packages(tmp_path: Path) -> None:
    rules = merged([parse_rules(SERVICE_RULES, "rules.yaml")])
    service = parse_service("int8 x\n---\nint8 z", "a_msgs/S")
    message = parse_message("int8 x", "a_msgs/M")
    definitions = Ros1Definitions(lambda name: {"a_msgs/M": message}[name], lambda _: service)
    (tmp_path / "b_interfaces" / "srv").mkdir(parents=True)
    (tmp_path / "b_interfaces" / "srv" / "T.srv").write_text("int8 y\n---\nint8 w")
    catalog = Catalog(Distribution.JAZZY, definitions, [tmp_path])
    catalog.add({"b_interfaces/msg/M": parse_ros2_message("int8 x", "b_interfaces/msg/M")})
    plans = Plans(catalog, definitions, rules)

    assert plans.for_ros1("a_msgs/M").ros2_type == "b_interfaces/msg/M"
    assert plans.for_ros2("b_interfaces/msg/M").ros1_type == "a_msgs/M"
    assert plans.service("a_msgs/S").request.to_cdr(b"\7") == b"\0\1\0\0\7"
    assert plans.service("a_msgs/S").response.to_cdr(b"\7") == b"\0\1\0\0\0"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a: 1", "must contain a list"),
        ("- 5", "a rule must be a mapping, got int"),
        ("- {ros1_package_name: a}", "the required key ros2_package_name must be a non-empty string"),
        ("- {ros1_package_name: a, ros2_package_name: b, x: 1}", "unknown key x"),
        (
            "- {ros1_package_name: a, ros2_package_name: b, ros1_message_name: c, ros1_service_name: d}",
            "one message, service or action",
        ),
        (
            "- {ros1_package_name: a, ros2_package_name: b, ros1_message_name: c, ros2_message_name: d, "
            "fields_1_to_2: [x]}",
            "must map field names",
        ),
        ("- {", "rules.yaml"),
    ],
)
def test_malformed_rules_raise(text: str, reason: str) -> None:
    with pytest.raises(InvalidRules, match=reason):
        parse_rules(text, "rules.yaml")


def test_an_unknown_type_names_what_was_tried() -> None:
    with pytest.raises(NotConvertible, match="tried turtlesim/msg/Pose"):
        plans_of(Distribution.JAZZY).for_ros1("turtlesim/Pose")
    with pytest.raises(NotConvertible, match="tried foo_interfaces/Bar, foo_msgs/Bar"):
        plans_of(Distribution.JAZZY).for_ros2("foo_interfaces/msg/Bar")


def test_headers_of_ros2_have_no_seq() -> None:
    cls: Any = load_message_class("std_msgs/Header")
    plan = plans_of(Distribution.JAZZY).for_ros1("std_msgs/Header")

    back = cls._from_bytes(plan.to_ros1(plan.to_cdr(serialized(cls(seq=5, frame_id="map")))))

    assert (plan.only_ros1, back.seq, back.frame_id) == (("seq",), 0, "map")


def test_durations_in_messages() -> None:
    cls: Any = load_message_class("visualization_msgs/Marker")
    plan = plans_of(Distribution.HUMBLE).for_ros1("visualization_msgs/Marker")
    message = cls(lifetime=Duration(1, 5))

    assert plan.only_ros2 == ("texture_resource", "texture", "uv_coordinates", "mesh_file")
    assert plan.to_ros1(plan.to_cdr(serialized(message))) == serialized(message)
