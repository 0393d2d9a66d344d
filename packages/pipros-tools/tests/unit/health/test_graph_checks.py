"""Findings about a running system: each fault is found, and nothing in a healthy one."""

from dataclasses import replace
from typing import Any

import pytest

from pipros_tools.graph.bus_info import BusConnection
from pipros_tools.graph.system_state import SystemState
from pipros_tools.health.finding import Findings, warning
from pipros_tools.health.graph_checks import check_graph, correct_name
from pipros_tools.health.nodelet_checks import services_of_managers, slow_nodelets
from pipros_tools.health.plugin_check import PluginCheck, PluginReply
from pipros_tools.health.system_report import (
    Failure,
    NodeReport,
    PublisherReport,
    ServiceReport,
    SystemReport,
)

TALKER, LISTENER, TOPIC = "/talker", "/listener", "/chatter"
TALKER_API, LISTENER_API = "http://10.0.0.1:1001/", "http://10.0.0.2:1002/"
SENT, RECEIVED = BusConnection(LISTENER, "o", TOPIC), BusConnection(TALKER_API, "i", TOPIC)

NODES = {
    TALKER: NodeReport(TALKER_API, connections=(SENT,), publications={TOPIC: "std_msgs/String"}),
    LISTENER: NodeReport(LISTENER_API, connections=(RECEIVED,), subscriptions={TOPIC: "std_msgs/String"}),
}

HEALTHY = SystemReport(
    "http://10.0.0.1:11311",
    SystemState({TOPIC: [TALKER]}, {TOPIC: [LISTENER], "/rosout": [LISTENER]}, {"/reset": [TALKER]}),
    types={TOPIC: "std_msgs/String"}, nodes=NODES,
    publishers={(TOPIC, TALKER): PublisherReport("10.0.0.1:7", None, "std_msgs/String", "992c", 0.1)},
    services={"/reset": ServiceReport(TALKER, "rosrpc://10.0.0.1:8")}, installed={"std_msgs/String": "992c"},
    clock_offset_s=0.4,
)  # fmt: skip


def with_node(name: str, **changes: Any) -> SystemReport:
    return replace(HEALTHY, nodes={**NODES, name: replace(NODES[name], **changes)})


def with_publisher(**changes: Any) -> SystemReport:
    report = HEALTHY.publishers[TOPIC, TALKER]
    return replace(HEALTHY, publishers={(TOPIC, TALKER): replace(report, **changes)})


UNCONNECTED = replace(HEALTHY, nodes={name: replace(node, connections=()) for name, node in NODES.items()})
TRIED = replace(UNCONNECTED, tried_back=frozenset({(TOPIC, LISTENER)}))
WITH_CLOCK = HEALTHY.state._replace(publishers={TOPIC: [TALKER], "/clock": [TALKER]})

FAULTS: dict[str, SystemReport] = {
    "ghost-node": with_node(LISTENER, failure=Failure("BusConnection refused", is_refused=True)),
    "unknown-host": with_node(LISTENER, failure=Failure("Name not known", is_unknown_host=True)),
    "silent-node": with_node(LISTENER, failure=Failure("no response in time")),
    "other-master": with_node(LISTENER, master_uri="http://10.0.0.1:11400/"),
    "no-publisher": with_publisher(address="", failure=Failure("Not a publisher of [/chatter]")),
    "unreachable-publisher": with_publisher(failure=Failure("no response in time")),
    "type-mismatch": with_node(LISTENER, subscriptions={TOPIC: "std_msgs/Int32"}),
    "one-sided-connection": with_node(LISTENER, connections=()), "not-connected": UNCONNECTED,
    "subscriber-cannot-reach": TRIED, "md5-mismatch": replace(TRIED, reached_back=TRIED.tried_back),
    "unknown-type": replace(HEALTHY, installed={"std_msgs/String": None}),
    "definition-differs": replace(HEALTHY, installed={"std_msgs/String": "other"}),
    "no-publishers": replace(HEALTHY,
        state=HEALTHY.state._replace(subscribers={TOPIC: [LISTENER], "/chater": [LISTENER]})),
    "service-failed": replace(HEALTHY,
        services={"/reset": ServiceReport(TALKER, "rosrpc://10.0.0.1:8", Failure("refused"))}),
    "no-clock": replace(HEALTHY, is_time_simulated=True), "clock-unused": replace(HEALTHY, state=WITH_CLOCK),
    "clock-differs": replace(HEALTHY, clock_offset_s=-3600.0),
    "stamps-differ": with_publisher(stamp_offset_s=100.0),
}  # fmt: skip


def test_nothing_is_found_in_a_healthy_system() -> None:
    assert check_graph(HEALTHY) == []


@pytest.mark.parametrize("rule", FAULTS)
def test_only_the_planted_fault_is_found(rule: str) -> None:
    findings = check_graph(FAULTS[rule])
    assert [finding.rule for finding in findings] == [rule]
    assert findings[0].cure


def judge(node: str, reply: PluginReply) -> Findings:
    if not reply.success:
        yield warning("closed", f"{node} is closed", "Open it.", node)


def test_nodes_of_rooms_are_judged_and_may_wait_for_publishers() -> None:
    node = "/door_1"
    subscribers = {TOPIC: [LISTENER], "/robot1/cmd": [node]}
    nodes = {**NODES, node: NodeReport("http://10.0.0.1:1003/")}
    state = HEALTHY.state._replace(subscribers=subscribers)
    check = PluginCheck("/door_", "state", judge)
    system = replace(
        HEALTHY, state=state, nodes=nodes, plugin_replies={node: PluginReply(check, success=True)}
    )

    assert check_graph(system) == []
    (finding,) = check_graph(replace(system, plugin_replies={node: PluginReply(check)}))
    assert finding.rule == "closed"


def test_an_action_server_without_a_client_is_healthy() -> None:
    state = HEALTHY.state._replace(
        publishers={TOPIC: [TALKER], "/move/status": [LISTENER]},
        subscribers={TOPIC: [LISTENER], "/move/goal": [LISTENER], "/move/cancel": [LISTENER]},
    )
    assert check_graph(replace(HEALTHY, state=state)) == []
    state = state._replace(publishers={TOPIC: [TALKER]})
    assert [finding.subjects for finding in check_graph(replace(HEALTHY, state=state))] == [
        ("/move/cancel", LISTENER),
        ("/move/goal", LISTENER),
    ]


@pytest.mark.parametrize(
    ("published", "missing"), [(["/tf"], []), (["/tf_static"], []), ([], ["/tf", "/tf_static"])]
)
def test_a_listener_needs_one_of_the_topics_of_tf(published: list[str], missing: list[str]) -> None:
    state = HEALTHY.state._replace(
        publishers={TOPIC: [TALKER], **{topic: ["/gone"] for topic in published}},
        subscribers={TOPIC: [LISTENER], "/tf": [LISTENER], "/tf_static": [LISTENER]},
    )
    found = [
        finding for finding in check_graph(replace(HEALTHY, state=state)) if finding.rule == "no-publishers"
    ]
    assert [finding.subjects[0] for finding in found] == missing


def test_two_clocks_are_found() -> None:
    state = HEALTHY.state._replace(publishers={TOPIC: [TALKER], "/clock": [TALKER, LISTENER]})
    rules = [finding.rule for finding in check_graph(replace(HEALTHY, state=state, is_time_simulated=True))]
    assert rules == ["two-clocks"]


def test_publishers_of_different_definitions_are_named() -> None:
    other = PublisherReport("10.0.0.2:9", None, "std_msgs/String", "beef")
    system = replace(
        HEALTHY,
        state=HEALTHY.state._replace(publishers={TOPIC: [TALKER, LISTENER]}, subscribers={}),
        publishers={**HEALTHY.publishers, (TOPIC, LISTENER): other},
    )
    findings = {finding.rule: finding for finding in check_graph(system)}
    assert set(findings) == {"publishers-differ", "definition-differs"}
    assert (
        "/talker: std_msgs/String 992c, /listener: std_msgs/String beef"
        in findings["publishers-differ"].summary
    )


def test_services_of_a_node_that_is_gone_are_not_reported_again() -> None:
    gone = Failure("BusConnection refused", is_refused=True)
    system = replace(
        HEALTHY, nodes={**NODES, TALKER: replace(NODES[TALKER], failure=gone)},
        services={"/reset": ServiceReport(TALKER, "rosrpc://10.0.0.1:8", gone)}, publishers={},
    )  # fmt: skip
    assert [finding.rule for finding in check_graph(system)] == ["ghost-node"]


def test_timestamps_of_simulated_time_are_distinguished_from_clock_offsets() -> None:
    (of_another,) = check_graph(with_publisher(stamp_offset_s=-1.7e9))
    assert "19676 days behind" in of_another.summary
    assert of_another.cure.startswith("Stamp with rospy.Time.now()")
    (differing,) = check_graph(FAULTS["stamps-differ"])
    assert "100 s ahead of" in differing.summary
    assert differing.cure.startswith("Synchronize the clocks of both machines")


def test_a_misspelt_topic_is_reported() -> None:
    (finding,) = check_graph(FAULTS["no-publishers"])
    assert "with similar names: /chatter." in finding.cure
    types = {TOPIC: "std_msgs/String", "/chater": "std_msgs/Int32"}
    (finding,) = check_graph(replace(FAULTS["no-publishers"], types=types))
    assert finding.cure == "Start its publisher."


@pytest.mark.parametrize(("readers", "others", "cure"), [
    ([], [], "If [/image_raw] is the intended topic, use this name."),
    (["/view"], [], "[/image_rav] is wrong: correct it in /view, or remap /image_rav:=/image_raw there."),
    (["/view", "/view"], [], "[/image_rav] is wrong: correct it in /view, or remap"),
    (["/view"], ["/log"], "[/image_rav] is wrong: correct it in /view, or"),
    (["/a", "/b"], ["/a"], "[/image_rav] is wrong: correct it in /a, /b, or remap"),
    (
        ["/a", "/b"],
        [],
        "[/image_raw] is wrong: correct it in /camera, or remap /image_raw:=/image_rav there.",
    ),
    (["/a", "/b", "/c"], ["/d"], "[/image_raw] is wrong: correct it in /camera, /d, or"),
])  # fmt: skip
def test_the_name_that_fewer_nodes_use_is_to_be_corrected(
    readers: list[str], others: list[str], cure: str
) -> None:
    state = SystemState({"/image_raw": ["/camera"]}, {"/image_rav": readers, "/image_raw": others}, {})
    system = replace(HEALTHY, state=state)
    assert cure in correct_name("/image_rav", ["/image_raw"], system)


def test_names_of_peers_cannot_forge_lines() -> None:
    system = replace(HEALTHY, state=SystemState({}, {"/evil\nERROR": [LISTENER]}, {}), publishers={})
    assert "\n" not in check_graph(system)[0].summary


def test_nodelets_that_drop_messages_are_found() -> None:
    lines = (
        "/a (x/A): /one 10.0 Hz, 0 of 100 dropped; /two 20.5 Hz, 30 of 200 dropped",
        "/b (x/B): no input",
    )
    system = SystemReport("http://m:1", SystemState.from_state([[], [], []]), nodelets=lines)
    (finding,) = slow_nodelets(system)
    assert finding.summary == "The nodelet [/a] dropped 30 of 200 messages of [/two] within a minute"
    assert finding.subjects == ("/a", "/two")


def test_only_managers_in_python_are_asked() -> None:
    services = ["/m/load_nodelet", "/m/inputs", "/genuine/load_nodelet", "/other/inputs"]
    state = SystemState.from_state([[], [], [[name, ["/n"]] for name in services]])
    assert list(services_of_managers(state)) == ["/m/inputs"]
