"""The programs of topic_tools of both sides: forwarded messages, subscriptions, service responses."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from std_msgs.msg import String

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.service_client import ServiceClient
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SIDES = ["pipros", "genuine"]


class Graph:
    """A master, a node of the test, and programs of one implementation.

    Attributes:
        got: the received messages, with their topics.
    """

    def __init__(self, ros: RosSystem, node: Node) -> None:
        self.ros = ros
        self.node = node
        self.got: list[tuple[str, str]] = []
        self.headers: dict[str, Any] = {}

    def start(self, side: str, program: str, *arguments: str) -> Process:
        runner = getattr(self.ros, side)
        return runner.start_node("topic_tools", program, *arguments)  # type: ignore[no-any-return]

    def listen(self, topic: str) -> Any:
        def keep(message: AnyMsg) -> None:
            self.headers[topic] = message.header
            self.got.append((topic, String().deserialize(message.body).data))

        return self.node.subscribe(topic, AnyMsg, keep)

    def publisher(self, topic: str, latch: bool = False) -> Callable[[str], None]:
        made = self.node.advertise(topic, String, queue_size=100, latch=latch)
        return lambda text: made.publish(String(text))

    def wait_for_link_to(self, topic: str) -> None:
        publication = self.node.endpoints.publication(self.node.resolve(topic))
        assert publication is not None
        wait_until(lambda: publication.links, 30, f"a subscriber of {topic}")

    def wait_for_link_from(self, topic: str, count: int = 1) -> None:
        subscription = self.node.endpoints.subscription(self.node.resolve(topic))
        assert subscription is not None
        wait_until(lambda: len(subscription.links) >= count, 30, f"a publisher of {topic}")

    def wait_for(self, *expected: tuple[str, str]) -> None:
        wait_until(lambda: len(self.got) >= len(expected), 30, lambda: f"only {self.got}")
        assert self.got == list(expected)

    def call(self, service: str, kind: str, *topic: str) -> Any:
        service_class: Any = load_service_class(f"topic_tools/{kind}")
        client: ServiceClient = self.node.client(service, service_class)
        wait_until(lambda: self._is_served(service), 30, service)
        return client.call(service_class._request_class(*topic))

    def _is_served(self, service: str) -> bool:
        return service in [name for name, _ in self.node.master.get_system_state()[2]]


@pytest.fixture
def graph(plain_ros: RosSystem) -> Iterator[Graph]:
    plain_ros.serve_master()
    with Node("probe", environment=Environment(master_uri=plain_ros.master_uri)) as node:
        yield Graph(plain_ros, node)


@pytest.mark.parametrize("side", SIDES)
def test_a_relay_forwards_the_type_of_roscpp_and_rospy(graph: Graph, side: str) -> None:
    other = SIDES[1 - SIDES.index(side)]
    publish = graph.publisher("/in")
    graph.listen("/out")
    graph.start(side, "relay", "/in", "/middle")
    graph.start(other, "relay", "middle", "/out")
    graph.wait_for_link_to("/in")

    publish("0")
    graph.ros.wait_for_publisher("/middle")
    wait_until(lambda: (publish("0"), graph.ros.publishers("/out"))[1], 30, "a publisher of /out")
    graph.wait_for_link_from("/out")
    wait_until(lambda: (publish("0"), ("/out", "0") in graph.got)[1], 30, "a message")
    for number in range(1, 6):
        publish(str(number))

    wait_until(lambda: ("/out", "5") in graph.got, 30, lambda: str(graph.got))
    assert [text for _, text in graph.got if text != "0"] == ["1", "2", "3", "4", "5"]
    header = graph.headers["/out"]
    assert (header["type"], header["md5sum"]) == ("std_msgs/String", String._md5sum)
    assert header["message_definition"].split() == String._full_text.split()


@pytest.mark.parametrize("program", [["relay", "/in"], ["throttle", "messages", "/in", "1000"]])
@pytest.mark.parametrize("side", SIDES)
def test_in_lazy_mode_the_input_is_subscribed_to_for_subscribers(graph, side, program: list[str]) -> None:
    target = f"/in_{program[0]}"
    publish = graph.publisher("/in", latch=True)
    publish("1")
    started = graph.start(side, *program, "_lazy:=true")
    graph.ros.wait_for_publisher(target)
    publish("2")
    wait_until(lambda: not graph.ros.subscribers("/in"), 30, "no subscriber of /in")

    listener = graph.listen(target)
    graph.ros.wait_for_subscriber("/in")
    wait_until(lambda: (target, "2") in graph.got, 30, started.output)
    assert graph.headers[target]["latching"] == "1", "as the input"

    listener.unregister()
    graph.ros.wait_for_subscriber("/in")
    wait_until(lambda: (publish("3"), not graph.ros.subscribers("/in"))[1], 30, "no subscriber of /in")


@pytest.mark.parametrize("side", SIDES)
def test_in_stealth_mode_the_monitored_topic_decides(graph: Graph, side: str) -> None:
    publish = graph.publisher("/in", latch=True)
    publish("1")
    graph.start(
        side, "relay", "/in", "/out", "_stealth:=true", "_monitor_topic:=/watched", "_monitor_rate:=50"
    )
    graph.ros.wait_for_publisher("/out")
    wait_until(lambda: not graph.ros.subscribers("/in"), 30, "no subscriber of /in")

    if side == "genuine":  # which does not subscribe again
        return
    graph.publisher("/watched")
    graph.listen("/out")
    with Node("watcher", environment=graph.node.environment) as watcher:
        watcher.subscribe("/watched", AnyMsg, lambda _: None)
        graph.ros.wait_for_subscriber("/in")
        wait_until(lambda: graph.got, 30, "a message")
    wait_until(lambda: not graph.ros.subscribers("/in"), 30, "no subscriber of /in")


@pytest.mark.parametrize("arguments", ["1 3", "0 2", "2 3", "3 2"])
@pytest.mark.parametrize("side", SIDES)
def test_the_first_of_every_few_messages_are_dropped(graph: Graph, side: str, arguments: str) -> None:
    dropped, of = map(int, arguments.split())
    publish = graph.publisher("/in")
    graph.listen("/in_drop")
    program = graph.start(side, "drop", "/in", *arguments.split())
    graph.wait_for_link_to("/in")
    for number in range(of):  # the count restarts after them, however many arrive
        publish(f"-{number}")
    graph.wait_for_link_from("/in_drop")

    for number in range(9):
        publish(str(number))
    passing = [str(number) for number in range(9) if number % of >= dropped]
    wait_until(lambda: [text for _, text in graph.got if "-" not in text] == passing, 30, str(graph.got))
    program.press_ctrl_c()
    program.wait()
    assert [text for _, text in graph.got if "-" not in text] == passing
    assert "advertised as /in_drop" in program.stdout


@pytest.mark.parametrize(
    ("arguments", "passing"),
    [
        (["messages", "/in", "1e6"], 9),
        (["messages", "/in", "0.0001"], 0),
        (["bytes", "/in", "500", "1000"], 4),  # 500 bytes, of which the first message had 104
    ],
)
@pytest.mark.parametrize("side", SIDES)
def test_a_throttle_forwards_up_to_its_limit(graph, side: str, arguments: list[str], passing: int) -> None:
    publish = graph.publisher("/in")
    graph.listen("/in_throttle")
    program = graph.start(side, "throttle", *arguments)
    graph.wait_for_link_to("/in")
    publish("-" * 100)
    graph.wait_for_link_from("/in_throttle")

    def arrived() -> list[str]:
        return [text for _, text in graph.got if "-" not in text]

    for number in range(9):
        publish(str(number) * 100)
    expected = [str(number) * 100 for number in range(passing)]
    wait_until(lambda: arrived() == expected, 30, lambda: str(arrived()))
    program.press_ctrl_c()
    program.wait()
    assert arrived() == expected


@pytest.mark.parametrize("side", SIDES)
def test_a_mux_forwards_the_selected_topic(graph: Graph, side: str) -> None:
    one, two = graph.publisher("/one"), graph.publisher("/two")
    graph.listen("/out")
    graph.listen("/mux/selected")
    graph.start(side, "mux", "/out", "/one", "two")
    for topic in ("/one", "/two"):
        graph.wait_for_link_to(topic)
    wait_until(lambda: (two("0"), graph.ros.publishers("/out"))[1], 30, "a publisher")
    graph.wait_for_link_from("/out")
    graph.wait_for_link_from("/mux/selected")

    graph.wait_for(("/mux/selected", "/one"))
    two("not this")
    one("a")
    graph.wait_for(("/mux/selected", "/one"), ("/out", "a"))
    graph.got.clear()
    assert graph.call("/mux/select", "MuxSelect", "/two").prev_topic == "/one"
    graph.wait_for(("/mux/selected", "/two"))
    one("not this")
    two("b")
    graph.wait_for(("/mux/selected", "/two"), ("/out", "b"))

    assert graph.call("/out_select", "MuxSelect", "__none").prev_topic == "/two"
    assert graph.call("/mux/select", "MuxSelect", "one").prev_topic == ""
    graph.call("/mux/add", "MuxAdd", "three")
    assert graph.call("/mux/list", "MuxList").topics == ["/one", "/two", "/three"]
    for service, topic in [
        ("Add", "/three"), ("Add", "__none"), ("Add", "b-d"), ("Delete", "/one"), ("Delete", "/four"),
        ("Select", "/four"), ("Select", ""),
    ]:  # fmt: skip
        with pytest.raises(Exception, match="error"):
            graph.call(f"/mux/{service.lower()}", f"Mux{service}", topic)
    graph.call("/mux/delete", "MuxDelete", "/two")
    wait_until(lambda: not graph.ros.subscribers("/two"), 30, "unsubscribed")
    assert graph.ros.subscribers("/one")


@pytest.mark.parametrize("side", SIDES)
def test_a_lazy_mux_subscribes_to_what_is_selected_and_wanted(graph: Graph, side: str) -> None:
    one = graph.publisher("/one", latch=True)
    one("1")
    graph.start(side, "mux", "/out", "/one", "/two", "mux:=/switch", "_lazy:=true", "_initial_topic:=/two")
    graph.ros.wait_for_publisher("/out")
    wait_until(lambda: not graph.ros.subscribers("/one"), 30, "unsubscribed")

    listener = graph.listen("/out")
    graph.ros.wait_for_subscriber("/two")
    assert graph.call("/switch/select", "MuxSelect", "/one").prev_topic == "/two"
    graph.wait_for(("/out", "1"))
    wait_until(lambda: not graph.ros.subscribers("/two"), 30, "unsubscribed")
    listener.unregister()
    wait_until(lambda: (one("2"), not graph.ros.subscribers("/one"))[1], 30, "unsubscribed")


@pytest.mark.parametrize("side", SIDES)
def test_a_demux_publishes_on_the_selected_topic(graph: Graph, side: str) -> None:
    publish = graph.publisher("/in")
    for topic in ("/one", "/two", "/demux/selected"):
        graph.listen(topic)
    graph.start(side, "demux", "/in", "/one", "two")
    graph.wait_for_link_to("/in")
    publish("0")  # which shows the type, and may come before there are links
    for topic in ("/one", "/two", "/demux/selected"):
        graph.wait_for_link_from(topic)
    publish("1")

    wait_until(lambda: ("/one", "1") in graph.got, 30, "the second message")
    wait_until(lambda: ("/demux/selected", "/one") in graph.got, 30, "what is selected")
    graph.got.clear()
    publish("a")
    graph.wait_for(("/one", "a"))
    assert graph.call("/demux/select", "DemuxSelect", "/two").prev_topic == "/one"
    graph.wait_for(("/one", "a"), ("/demux/selected", "/two"))
    publish("b")
    graph.wait_for(("/one", "a"), ("/demux/selected", "/two"), ("/two", "b"))

    graph.call("/demux/add", "DemuxAdd", "/three")
    assert graph.call("/demux/list", "DemuxList").topics == ["/one", "/two", "/three"]
    for service, topic in [
        ("Add", "/three"), ("Add", "__none"), ("Add", "b-d"), ("Delete", "/two"), ("Delete", "/four"),
        ("Select", "/four"),
    ]:  # fmt: skip
        with pytest.raises(Exception, match="error"):
            graph.call(f"/demux/{service.lower()}", f"Demux{service}", topic)
    graph.call("/demux/delete", "DemuxDelete", "/three")
    assert graph.call("/demux/list", "DemuxList").topics == ["/one", "/two"]
    assert graph.call("/demux/select", "DemuxSelect", "__none").prev_topic == "/two"


@pytest.mark.parametrize("side", SIDES)
def test_expressions_make_messages(graph: Graph, side: str) -> None:
    Quaternion: Any = load_message_class("geometry_msgs/Quaternion")  # noqa: N806
    got: dict[str, Any] = {}
    programs = {
        "half": ["transform", "/in/x", "/half", "std_msgs/Float64", "m / 2"],
        "norm": ["transform", "in", "/norm", "std_msgs/Float64", "numpy.linalg.norm([m.x, m.y, m.z, m.w])"],
        "text": ["transform", "/in/x", "/text", "std_msgs/String", "str(m)", "--latch"],
        "point": [
            *["transform", "/in", "/point", "geometry_msgs/PointStamped"],
            "std_msgs.msg.Header(frame_id='map'), geometry_msgs.msg.Point(m.x, m.y, numpy.sum([m.z, m.w]))",
            *["--import", "geometry_msgs", "std_msgs", "numpy"],
        ],
        "field": ["relay_field", "/in", "/field", "geometry_msgs/Point", "{x: m.w * 2, y: 3, z: m.z}"],
    }
    if (
        side == "genuine"
    ):  # whose relay_field needs Python 2, and whose `import std_msgs` does not import std_msgs.msg
        programs["point"][-3:] = ["geometry_msgs.msg", "std_msgs.msg", "numpy", "std_msgs", "geometry_msgs"]
        del programs["field"]
    publisher = graph.node.advertise("/in", Quaternion, queue_size=5, latch=True)
    publisher.publish(Quaternion(3.0, 4.0, 12.0, 0.0))
    for name, program in programs.items():
        kind = load_message_class({"field": "geometry_msgs/Point"}.get(name, "std_msgs/Float64"))
        kind = {"text": String, "point": load_message_class("geometry_msgs/PointStamped")}.get(name, kind)
        graph.node.subscribe(f"/{name}", kind, lambda message, name=name: got.update({name: message}))
        graph.start(side, *program)

    def all_are_there() -> bool:
        publisher.publish(Quaternion(3.0, 4.0, 12.0, 0.0))
        return len(got) == len(programs)

    wait_until(all_are_there, 60, lambda: str(got))
    wrong = graph.start(side, "transform", "/in/nope", "/never", "std_msgs/Float64", "m")
    assert wrong.wait(60) == 1
    assert "Wrong input topic (or topic field): /in/nope" in str(wrong.lines)
    assert (got["half"].data, got["norm"].data, got["text"].data) == (1.5, 13.0, "3.0")
    assert (got["point"].header.frame_id, got["point"].point.y, got["point"].point.z) == ("map", 4.0, 12.0)
    if side == "genuine":
        return
    assert (got["field"].x, got["field"].y, got["field"].z) == (0.0, 3.0, 12.0)


WRONG = [
    "relay", "throttle", "throttle messages /a", "throttle bytes /a 1", "throttle kilograms /a 1",
    "drop /a 1", "drop /a 3 0", "mux /out", "demux /in", "switch_mux /out", "mux_add mux", "mux_list",
    "transform /a", "relay_field",
]  # fmt: skip


def test_wrong_arguments_end_alike(graph: Graph) -> None:
    def ended(side: str) -> list[Any]:
        started = [graph.start(side, *line.split()) for line in WRONG]
        return [
            (line, program.wait(120), [text for text in program.stdout if "usage" in text.lower()])
            for line, program in zip(WRONG, started, strict=True)
        ]

    ours, genuine = ended("pipros"), ended("genuine")

    assert [(line, code) for line, code, _ in ours] == [(line, code) for line, code, _ in genuine]
    assert [[text.strip() for text in usage] for *_, usage in ours] == [
        [text.strip() for text in usage] for *_, usage in genuine
    ]


@pytest.mark.parametrize("caller", SIDES)
def test_programs_call_the_mux_of_the_other_side(graph: Graph, caller: str) -> None:
    graph.start(SIDES[1 - SIDES.index(caller)], "mux", "/out", "/one", "/two")
    for program, arguments, shown in [
        ("mux_add", ["mux", "/three"], 'Adding "/three" to mux "mux"'),
        ("mux_list", ["mux"], "['/one', '/two', '/three']"),
        ("mux_select", ["/mux", "/three"], 'Selecting "/three" at mux "/mux"'),
        (
            "mux_delete", ["mux", "/three"],
            "Service call failed: service [/mux/delete] responded with an error",
        ),
        ("switch_mux", ["/out", "/two"], "muxed topic /out successfully switched from /three to /two"),
    ]:  # fmt: skip
        ended = graph.start(caller, program, *arguments)
        assert (ended.wait(60), shown in ended.output) == (0, True), ended.output

    refused = graph.start(caller, "switch_mux", "/out", "/nothing")
    assert refused.wait(60) == 1
    assert "failed to switch muxed topic /out to /nothing" in refused.output
