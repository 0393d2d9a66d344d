"""The view of a ROS 2 domain, whose other participant is an engine of pipros."""

import contextlib
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from pipros.basics.errors import InvalidName, NotFound, PiprosError
from pipros_ros2.commands import look as look_commands
from pipros_ros2.commands import messages as message_commands
from pipros_ros2.interface import Endpoint, EndpointKind, TopicQos
from pipros_ros2.look import DomainView, actions, services, topic_of, topics
from pipros_ros2.ros2_graph import Ros2Graph, callable_server
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.engine import RtpsEngine
from pipros_rosbag2 import names
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.cdr import decode, encode
from pipros_rosbag2.interfaces.parse import parse_ros2_message
from tests.support.ros2_domains import free_domain

STRING = "std_msgs/msg/String"


@pytest.fixture
def ends() -> Iterator[tuple[DomainView, RtpsEngine]]:
    with free_domain() as domain:
        discovery = Discovery.from_environment({"ROS_DOMAIN_ID": str(domain)})
        view, other = DomainView(discovery, Distribution.JAZZY), RtpsEngine(discovery, "/other")
        try:
            yield view, other
        finally:
            view.close()
            other.close()


def test_a_topic_is_found_with_its_type_and_publishers(ends: tuple[DomainView, RtpsEngine]) -> None:
    view, other = ends
    message = view.message(STRING)
    other.advertise("/chatter", STRING, view.hash_of(message), TopicQos())
    other.subscribe("/heard", STRING, "", TopicQos(), lambda _sample: None)

    kind, announced, publishers = topic_of(view, "/chatter", 30)
    assert (kind, len(publishers)) == (STRING, 1)
    assert view.message(kind, announced) is message
    assert topic_of(view, "/heard", 30)[2] == []
    assert [each.name for each in topics(view.endpoints())] == ["/chatter", "/heard"]


def test_a_missing_topic_a_foreign_definition_and_an_invalid_type_are_errors(
    ends: tuple[DomainView, RtpsEngine],
) -> None:
    view, other = ends
    with pytest.raises(NotFound, match=r"topic \[/none\] does not appear to be published yet"):
        topic_of(view, "/none", 0)
    with pytest.raises(PiprosError, match=r"definition of std_msgs/msg/String differs.* set --distro"):
        view.message(STRING, "RIHS01_0")
    with pytest.raises(InvalidName, match=r"package/srv/Name, got \[std_srvs/Empty\]"):
        view.service("std_srvs/Empty")
    for kind in (STRING, "std_msgs/msg/Bool"):
        other.advertise("/both", kind, "", TopicQos())
    view.wait_for("/both", EndpointKind.PUBLISHER, 30)
    view.endpoints()
    with pytest.raises(PiprosError, match=r"several types: std_msgs/msg/Bool, std_msgs/msg/String"):
        topic_of(view, "/both", 30)


def test_a_service_is_called(ends: tuple[DomainView, RtpsEngine]) -> None:
    view, other = ends
    service = view.service("std_srvs/srv/SetBool")

    def answer(request: bytes) -> bytes:
        values = view.decode(request, service.request)
        return view.encode({"success": values["data"]}, service.response)

    other.serve("/switch", service.type, "", answer, view.parts(service))
    assert view.wait_for("/switch", EndpointKind.SERVER, 30)
    caller = view.engine.caller("/switch", service.type, "", view.parts(service))
    while not caller.is_available:
        view.endpoints(0)
    reply = view.decode(caller.call(view.encode({"data": True}, service.request), 30), service.response)

    assert reply == {"success": True, "message": ""}
    assert view.python_text(reply, service.response) == (
        "std_srvs.srv.SetBool_Response(success=True, message='')"
    )


def test_long_arrays_and_texts_are_shortened(ends: tuple[DomainView, RtpsEngine]) -> None:
    view, _ = ends
    text, array = view.message(STRING), view.message("std_msgs/msg/Float64MultiArray")
    values = {"layout": {"dim": [], "data_offset": 0}, "data": [0.5] * 200}

    assert view.shown({"data": "a" * 200}, text, no_arrays=False, is_whole=False) == {
        "data": "a" * 128 + "..."
    }
    assert view.shown({"data": "a" * 200}, text, no_arrays=False, is_whole=True) == {"data": "a" * 200}
    assert view.shown(values, array, no_arrays=False, is_whole=False)["data"] == [0.5] * 128 + ["..."]
    assert view.shown(values, array, no_arrays=True, is_whole=False) == {
        "layout": {"dim": "<sequence type: std_msgs/MultiArrayDimension, length: 0>", "data_offset": 0},
        "data": "<sequence type: double, length: 200>",
    }
    covariance = view.message("geometry_msgs/msg/PoseWithCovariance")
    whole = decode(encode({}, covariance, view.message), covariance, view.message)
    assert view.shown(whole, covariance, no_arrays=True, is_whole=False)["covariance"] == (
        "<array type: double[36]>"
    )
    assert view.python_text({"data": [1.5], "layout": {"dim": [{}], "data_offset": 1}}, array) == (
        "std_msgs.msg.Float64MultiArray(layout=std_msgs.msg.MultiArrayLayout("
        "dim=[std_msgs.msg.MultiArrayDimension()], data_offset=1), data=[1.5])"
    )


def test_the_services_of_an_action_are_hidden() -> None:
    kind = "test_msgs/action/Fibonacci_SendGoal"
    goal = Endpoint(b"1", EndpointKind.SERVER, "/fib/_action/send_goal", kind)

    assert [(each.name, each.types) for each in actions([goal])] == [
        ("/fib", ("test_msgs/action/Fibonacci",))
    ]
    assert [each.is_hidden for each in services([goal])] == [True]


def test_names_and_messages_of_peers_are_escaped_and_bad_ones_left_out(monkeypatch, capsys) -> None:
    hostile = "\x1b]0;OWNED\x07\nforged"
    kind, payload = "std_msgs/msg/String", b"\0\1\0\0\5\0\0\0\x1b[2J\0"
    ends = [Endpoint(b"1", EndpointKind.PUBLISHER, f"/a{hostile}", kind, hostile, node=f"/n{hostile}")]
    view = SimpleNamespace(
        endpoints=lambda: ends,
        message=lambda *_: parse_ros2_message("string data", kind),
        decode=lambda data, message: decode(data, message, lambda _: message),
        shown=lambda values, _, **__: values,
    )
    for module in (look_commands, message_commands):
        monkeypatch.setattr(module, "domain_view", lambda _: contextlib.nullcontext(view))
    monkeypatch.setattr(message_commands, "_subscribed", lambda *_: (kind, "", [payload[:6], payload]))
    assert look_commands.topics(["-t"]) == look_commands.topics(["-v"]) == look_commands.nodes([]) == 0
    printed = capsys.readouterr().out
    assert printed.count("\\x1b]0;OWNED\\x07\\nforged") == 3
    assert message_commands.echo(["/a", "--field", "data"]) == 0
    shown = capsys.readouterr()
    assert shown.out == "\\x1b[2J\n---\n"
    assert "WARNING: a message is left out: the message ends" in shown.err
    assert "\x1b" not in printed + shown.out + shown.err


# The ROS 2 topics, services and actions that a gateway finds.


ADD = "example_interfaces/srv/AddTwoInts"
FIBONACCI = "example_interfaces/action/Fibonacci_SendGoal"


def test_endpoints_are_sorted_by_what_they_offer() -> None:
    talkers = [
        Endpoint(bytes([n]), EndpointKind.PUBLISHER, "/chatter", "std_msgs/msg/String") for n in (1, 2)
    ]
    adder = Endpoint(b"3", EndpointKind.SERVER, "/add", ADD)
    action = Endpoint(b"4", EndpointKind.SERVER, "/fibonacci/_action/send_goal", FIBONACCI)
    others = [
        Endpoint(b"5", EndpointKind.SUBSCRIBER, "/chatter", "std_msgs/msg/String"),
        Endpoint(b"6", EndpointKind.CLIENT, "/add", ADD),
    ]

    graph = Ros2Graph([*talkers, adder, action, *others])

    assert (graph.publishers, graph.services) == ({"/chatter": talkers}, {"/add": [adder]})
    assert graph.actions == {"/fibonacci": [action]}


def test_servers_that_cannot_be_called_are_passed_over() -> None:
    unknown = Endpoint(b"1", EndpointKind.SERVER, "/add", ADD, problem="unknown form")
    known = Endpoint(b"2", EndpointKind.SERVER, "/add", ADD)

    assert callable_server([unknown, known]) is known
    with pytest.raises(PiprosError, match="unknown form"):
        callable_server([unknown])


# The ROS 2 names in DDS and Zenoh.


STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"


def test_topics_and_services_have_prefixes() -> None:
    assert names.dds_topic("/a/b") == "rt/a/b"
    assert names.dds_service("/add") == names.ServiceTopics("rq/addRequest", "rr/addReply")
    assert names.topic_of_dds("rt/a/b") == "/a/b"
    assert names.topic_of_dds("ros_discovery_info") is None
    assert names.service_of_dds("rq/addRequest") == names.service_of_dds("rr/addReply") == "/add"
    assert names.service_of_dds("rq/addReply") is None


def test_actions_are_services_and_topics() -> None:
    found = names.action_names("/turn")

    assert names.dds_service(found.send_goal).request == "rq/turn/_action/send_goalRequest"
    assert names.dds_topic(found.feedback) == "rt/turn/_action/feedback"


@pytest.mark.parametrize(("name", "in_dds"), [
    ("std_msgs/msg/String", "std_msgs::msg::dds_::String_"),
    ("std_srvs/srv/SetBool_Request", "std_srvs::srv::dds_::SetBool_Request_"),
    ("a/action/Turn_SendGoal_Request", "a::action::dds_::Turn_SendGoal_Request_"),
])  # fmt: skip
def test_types_have_a_form_in_dds(name: str, in_dds: str) -> None:
    assert (names.dds_type(name), names.type_of_dds(in_dds)) == (in_dds, name)


def test_other_types_are_not_of_ros2() -> None:
    assert names.type_of_dds("HelloWorld") is None


def test_keys_equal_the_published_ones() -> None:
    assert names.zenoh_key(0, "/chatter", "std_msgs/msg/String", STRING_HASH) == (
        f"0/chatter/std_msgs::msg::dds_::String_/{STRING_HASH}"
    )


@pytest.mark.parametrize("name", ["chatter", "/", "/a/", "/9a", "/a//b", "/a__b", "/a-b", "", "/é"])
def test_names_that_ros2_refuses_raise(name: str) -> None:
    with pytest.raises(InvalidName, match="is not a full ROS 2 name"):
        names.dds_topic(name)


def test_a_name_has_a_maximum_length_in_dds() -> None:
    assert len(names.dds_topic("/" + "a" * 252)) == 255
    with pytest.raises(InvalidName, match="more than 255 characters"):
        names.dds_topic("/" + "a" * 253)
