"""The decisions of the programs of topic_tools, without a graph."""

import json
import threading
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.errors import NotFound, PiprosError
from pipros.msg import load_message_class
from pipros.msg.time import Duration, Time
from pipros.safe.expr_walk import ExpressionError
from pipros_libraries.topic_tools.expressions import NotAMapping, Template, Transformation, module_for
from pipros_libraries.topic_tools.lazy import LazyInputs
from pipros_libraries.topic_tools.rates import ByteRate, Dropping, MessageRate
from pipros_libraries.topic_tools.raw import MissingType, class_like
from pipros_libraries.topic_tools.selection import NONE, BadSelection, Selection
from topic_tools.nodes import demux

Imu: Any = load_message_class("sensor_msgs/Imu")


def transformed(text: str, message: Any, *modules: str) -> Any:
    return Transformation(text, modules, lambda: Time(7, 0)).arguments(message)


def test_a_rate_is_reset_when_the_clock_goes_back() -> None:
    rule = MessageRate(1.0)
    times = [10.0, 10.5, 2.0, 2.5, 3.5]

    assert [(rule.passes(int(time * 1e9), 1), rule.has_gone_back) for time in times] == [
        (True, False), (False, False), (False, True), (False, False), (True, False),
    ]  # fmt: skip


def test_bytes_are_counted_within_the_window() -> None:
    rule = ByteRate(20, window_s=2.0)

    assert [rule.passes(int(time * 1e9), 10) for time in (0, 1, 1.5, 2.1, 2.2, 3.2)] == [
        True, True, False, True, False, True,
    ]  # fmt: skip
    assert rule.passes(0, 10), "the clock went back"


def test_no_message_is_forwarded_if_all_are_dropped() -> None:
    rule = Dropping(5, of=2)
    assert not any(rule.passes(0, 0) for _ in range(10))


def test_a_selection_keeps_its_order_and_refuses_invalid_topics() -> None:
    selection = Selection(["/a", "/b", "/a"], "mux")
    assert (selection.topics, selection.selected) == (["/a", "/b"], "/a")
    assert (selection.select("/b"), selection.select(NONE), selection.selected) == ("/a", "/b", "")
    selection.add("/c")
    selection.delete("/a")
    assert selection.topics == ["/b", "/c"]
    selection.select("/c")

    with pytest.raises(BadSelection, match="its topics are: /b, /c"):
        selection.select("/a")
    for wrong in ("/b", "/x y", "", "/", f"/{NONE}", "/" + "x" * 65_533):
        with pytest.raises(BadSelection):
            selection.add(wrong)
    for wrong in ("/c", "/z"):
        with pytest.raises(BadSelection):
            selection.delete(wrong)
    assert Selection([], "mux").selected == ""


def test_a_class_has_the_fields_of_the_publishers_definition() -> None:
    made = class_like({"type": "a/B", "md5sum": "f" * 32, "message_definition": "int8 x"})
    assert (made._type, made._md5sum, made._full_text) == ("a/B", "f" * 32, "int8 x")

    for header in ({}, {"type": "a/B"}, {"type": "*", "md5sum": "*", "callerid": "/evil\x1b[2J"}):
        with pytest.raises(MissingType) as refused:
            class_like(header)
        assert "\x1b" not in str(refused.value)


@pytest.mark.parametrize(("text", "modules", "value"), [
    ("m.linear_acceleration.x * 2", [], [6.0]),
    ("(m.header.seq, str(m.linear_acceleration.x))", [], (1, "3.0")),
    ("math.hypot(m.linear_acceleration.x, 4)", ["math"], [5.0]),
    ("float(numpy.rad2deg(numpy.pi))", ["numpy"], [180.0]),
    ("numpy.linalg.norm([m.linear_acceleration.x, 4]).item()", ["numpy"], [5.0]),
    ("(numpy.array([1, 2]) * 3).tolist()", ["numpy"], [3, 6]),
    ("tf.transformations.quaternion_from_euler(0, 0, 0).tolist()", ["tf"], [0.0, 0.0, 0.0, 1.0]),
    ("rospy.Time.now() + rospy.Duration(1)", ["rospy"], [Time(8, 0)]),
    ("rospy.get_rostime() - rospy.Time.now()", ["rospy.rostime"], [Duration(0)]),
    ("geometry_msgs.msg.Point(1, 2, 3).z", ["geometry_msgs.msg"], [3]),
])  # fmt: skip
def test_expressions_compute(text: str, modules: list[str], value: Any) -> None:
    if {"numpy", "tf"} & set(modules):
        pytest.importorskip("numpy")
    message = Imu()
    message.header.seq, message.linear_acceleration.x = 1, 3.0

    assert transformed(text, message, *modules) == value


@pytest.mark.parametrize(("text", "modules"), [
    ("os.system('true')", ["os"]), ("subprocess.run('true')", ["subprocess"]), ("m.__class__", []),
    ("m.serialize(m)", []), ("m._slot_types", []), ("(lambda: 1)()", []),
    ("numpy.fromfile('/etc/passwd')", ["numpy"]), ("numpy.zeros(10**9)", ["numpy"]),
    ("numpy.load('x')", ["numpy"]), ("numpy.array([1]).tofile('x')", ["numpy"]),
    ("numpy.linalg.os", ["numpy"]), ("geometry_msgs.msg.Nothing()", ["geometry_msgs"]),
    ("geometry_msgs.srv", ["geometry_msgs"]), ("rospy.signal_shutdown('now')", ["rospy"]),
    ("tf.transformations.numpy", ["tf"]), ("x + 1", []), ("m +", []),
])  # fmt: skip
def test_expressions_can_only_compute(text: str, modules: list[str]) -> None:
    if {"numpy", "tf"} & set(modules):
        pytest.importorskip("numpy")
    with pytest.raises(ExpressionError):
        transformed(text, Imu(), *modules)


def test_a_module_that_is_not_used_may_be_missing() -> None:
    made = Transformation("m + 1", ["os", "math"], Time)

    assert (list(made.arguments(1)), list(made.missing)) == ([2], ["os"])
    assert "an expression cannot import os; it can import numpy, math" in made.missing["os"]
    with pytest.raises(NotFound):
        module_for("pickle", Time)


def test_a_template_evaluates_expressions_and_keeps_other_text() -> None:
    message = Imu()
    message.header.seq, message.header.frame_id = 5, "imu"
    text = """
    header: {seq: m.header.seq * 2, stamp: now, frame_id: base_link}
    child_frame_id: map
    names: [m.header.seq]
    length: len(m.header.frame_id)
    text: "'a' + 'b'"
    number: 4
    path: a/b c
    """

    assert Template(text).fields(message) == {
        "header": {"seq": 10, "stamp": "now", "frame_id": "base_link"}, "child_frame_id": "map",
        "names": ["m.header.seq"], "length": 3, "text": "ab", "number": 4, "path": "a/b c",
    }  # fmt: skip


@pytest.mark.parametrize("text", ["m", "[1, 2]", "", "{a: ", "!!python/object/apply:os.system ['true']"])
def test_a_template_that_is_not_a_mapping_is_refused(text: str) -> None:
    with pytest.raises((NotAMapping, PiprosError)):
        Template(text)


def test_a_template_that_names_a_missing_field_is_refused() -> None:
    with pytest.raises(ExpressionError, match="has no field"):
        Template(json.dumps({"data": "m.nothing"})).fields(Imu())


def test_an_output_that_is_added_later_has_the_type_of_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    advertised: dict[str, str] = {}

    class FakeOutput:
        def __init__(self, topic: str) -> None:
            self.topic = topic
            self.has_subscriber = threading.Event()
            self.has_subscriber.set()

        def advertise_like(self, message: Any, latch: bool) -> bool:
            is_new = self.topic not in advertised
            advertised.setdefault(self.topic, message.header["type"])
            return is_new

        def publish(self, message: Any) -> None:
            pass

    monkeypatch.setattr(demux, "Output", FakeOutput)
    mine: Any = demux.Demux(Selection(["/first", "/second"], "demux"))
    mine.pass_on(SimpleNamespace(header={"type": "std_msgs/String"}))
    mine.add("/later")
    mine.pass_on(SimpleNamespace(header={"type": "std_msgs/Int32"}))
    assert advertised == dict.fromkeys(("/first", "/second", "/later"), "std_msgs/String")


# Lazy


class Output:
    """A publisher with any number of subscribers, which notifies its listeners."""

    def __init__(self) -> None:
        self.connection_count = 0
        self.listeners: list[Any] = []
        self.publication = self

    def change(self, by: int) -> None:
        self.connection_count += by
        for each in self.listeners:
            if by > 0:
                each.peer_subscribe("/out", None, None)
            else:
                each.peer_unsubscribe("/out", self.connection_count)


class Input:
    is_registered = True

    def unregister(self) -> None:
        self.is_registered = False


def test_inputs_are_subscribed_to_while_an_output_has_subscribers() -> None:
    outputs, made = [Output(), Output()], []

    def subscribe() -> list[Input]:
        made.append(Input())
        return made[-1:]

    lazy = LazyInputs(outputs, subscribe)
    assert not made
    outputs[0].change(1)
    outputs[1].change(1)
    outputs[0].change(-1)
    assert [each.is_registered for each in made] == [True]
    outputs[1].change(-1)
    assert [each.is_registered for each in made] == [False]
    outputs[1].change(1)
    assert [each.is_registered for each in made] == [False, True]
    lazy.close()
    outputs[0].change(1)
    assert ([each.is_registered for each in made], outputs[0].listeners) == ([False, False], [])


def test_subscribers_that_came_before_count() -> None:
    output, made = Output(), [Input()]
    output.connection_count = 1
    LazyInputs([output], lambda: made).close()
    assert not made[0].is_registered
