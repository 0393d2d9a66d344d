"""Which data are stale, and what the bell in the head of the page lists."""

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from pipros.node.any_msg import AnyMsg
from pipros_page.notices import Notices
from pipros_page.stale import TopicActivity, is_stale
from pipros_page.topic_watch import TopicWatch
from pipros_page.traffic import TopicTraffic, topic_traffic
from pipros_page.views.diagnostics import Statuses
from pipros_page.views.graph_values import traffic_values
from pipros_page.views.notices import leaves
from pipros_page.views.topics import topic_rows
from pipros_tools.graph.drawing.grouping import Grouping, grouped
from pipros_tools.graph.drawing.node_graph import GraphOptions, node_graph
from pipros_tools.graph.drawing.scene import draw
from pipros_tools.graph.observer import GraphObservation, ObservedNode, Traffic
from pipros_tools.graph.raw_decoder import RawDecoder
from pipros_tools.graph.system_state import SystemState, TopicConnection

LINK = TopicConnection("/driver", "/scan", "/slam")


def observation(
    traffic: Traffic | None = None,
    *,
    has_link: bool = True,
    publishers: tuple[str, ...] = ("/driver",),
    subscribers: tuple[str, ...] = ("/slam",),
    error: str = "",
) -> GraphObservation:
    state = SystemState({"/scan": publishers} if publishers else {}, {"/scan": subscribers}, {})
    return GraphObservation(
        state, {"/scan": "sensor_msgs/LaserScan"}, {"/driver": ObservedNode("http://driver:1", error)},
        {LINK: traffic} if has_link else {},
    )  # fmt: skip


@pytest.mark.parametrize(("age_s", "interval_s", "expected"), [
    (2.9, 0.01, False), (3.1, 0.01, True), (9.9, 1.0, False), (10.1, 1.0, True), (1e9, None, False)
])  # fmt: skip
def test_data_are_stale_after_ten_intervals_and_at_least_three_seconds(
    age_s: float, interval_s: float | None, expected: bool
) -> None:
    assert is_stale(age_s, interval_s) is expected


def test_a_topic_whose_regular_messages_end_is_stale_until_they_come_again() -> None:
    activity = TopicActivity()
    activity.add(observation(Traffic(10.0, 100.0, 0.0, 0.1)), 100.0)
    activity.add(observation(Traffic(4.0, 40.0, 2.9, 0.1)), 103.0)
    assert activity.stale() == {}
    activity.add(observation(Traffic(0.0, 0.0, 5.0, 0.1)), 106.0)
    assert activity.stale() == {"/scan": 5.0}
    activity.add(observation(Traffic(2.0, 20.0, 0.0, 0.1)), 107.0)
    assert activity.stale() == {}


def test_irregular_messages_do_not_become_stale() -> None:
    activity = TopicActivity()
    activity.add(observation(Traffic(0.2, 2.0, 0.0)), 100.0)
    activity.add(observation(Traffic(0.0, 0.0, 50.0)), 150.0)
    assert activity.stale() == {}


def test_a_topic_is_stale_when_its_publisher_died_but_not_without_subscribers() -> None:
    activity = TopicActivity()
    for error, publishers in (("no answer", ("/driver",)), ("", ())):
        activity.add(observation(Traffic(10.0, 100.0, 0.0, 0.1)), 100.0)
        activity.add(observation(has_link=False, publishers=publishers, error=error), 104.0)
        assert activity.stale() == {"/scan": 4.0}
    activity.add(observation(Traffic(10.0, 100.0, 0.0, 0.1)), 200.0)
    activity.add(observation(has_link=False), 204.0)
    assert activity.stale() == {}


def test_a_second_subscriber_keeps_a_topic_active_before_its_interval_is_known() -> None:
    activity = TopicActivity()
    activity.add(observation(Traffic(10.0, 100.0, 0.0, 0.1)), 100.0)
    activity.add(observation(Traffic(10.0, 100.0, 0.0)), 105.0)
    assert activity.stale() == {}


def test_notices_name_what_became_stale_and_came_back() -> None:
    notices = Notices()
    notices.note_stale("frame", {"hand": 4.0}, 100.0)
    notices.note_stale("topic", {"/hand": 3.5}, 100.0)
    notices.note_stale("frame", {"hand": 14.0}, 110.0)
    assert notices.stale() == [("topic", "/hand", 96.5), ("frame", "hand", 96.0)]
    notices.note_stale("frame", {}, 120.0)
    notices.forget("topic", {"/hand"})
    found = [(each.what, each.kind, each.name) for each in notices.recent(125.0)]
    assert found == [("back", "frame", "hand"), ("stale", "topic", "/hand"), ("stale", "frame", "hand")]
    assert notices.stale() == []
    assert [each.what for each in notices.recent(170.0)] == ["back"]
    assert notices.recent(180.0) == []


def test_equal_errors_are_counted_and_failing_sources_named_once() -> None:
    notices = Notices()
    for when_s in (1.0, 2.0, 3.0):
        notices.note_error("node", "/arm", "stuck", when_s)
        notices.note_failing("component", {"motor": "hot"}, when_s)
    notices.note_failing("component", {}, 4.0)
    notices.note_failing("component", {"motor": "hot"}, 5.0)
    found = [(each.name, each.text, each.count, each.when_s) for each in notices.recent(6.0)]
    assert found == [("motor", "hot", 2, 5.0), ("/arm", "stuck", 3, 3.0)]


def test_components_are_stale_without_reports_and_groups_are_left_out() -> None:
    statuses = Statuses(1_000_000)
    reports = [
        DiagnosticStatus(level=level, name=name) for name, level in (("/Motors/left", 2), ("/Motors", 2))
    ]
    statuses.add(DiagnosticArray(status=reports), None, 100.0)
    assert leaves(statuses.levels(101.0)) == {"/Motors/left": (2, 1.0, "")}
    assert leaves(statuses.levels(105.5)) == {"/Motors/left": (3, 5.5, "")}


# The rate and bandwidth of a topic, which all views share.


TOPIC = "/odom"
TWO_SUBSCRIBERS = {("/a", "/x"): Traffic(10.0, 1000.0), ("/a", "/page"): Traffic(9.0, 900.0)}


def observed(topic: str, connections: dict[tuple[str, str], Traffic | None]) -> GraphObservation:
    publishers = tuple(dict.fromkeys(publisher for publisher, _ in connections))
    subscribers = tuple(dict.fromkeys(subscriber for _, subscriber in connections))
    return GraphObservation(
        state=SystemState({topic: publishers}, {topic: subscribers}, {}),
        types={topic: "nav_msgs/Odometry"},
        connections={TopicConnection(start, topic, end): each for (start, end), each in connections.items()},
    )


def graph_figures(observation: GraphObservation, traffic: dict[str, TopicTraffic]) -> list[float] | None:
    """Return the traffic on the drawn edge from the publisher to the topic."""
    graph = node_graph(observation.state, observation.connections, {}, GraphOptions(mode="all"), {})
    scene = draw(grouped(graph, observation.state.topics(), Grouping()), with_traffic=True)
    values = traffic_values(observation, scene, traffic)
    [found] = [
        each
        for (arrow, _, _), each in zip(scene.arrows, values, strict=True)
        if arrow.start.kind == "node" and arrow.end.kind == "topic"
    ]
    return found


def test_bytes_count_once_however_many_subscribers_there_are() -> None:
    observation = observed(TOPIC, TWO_SUBSCRIBERS)
    traffic = dict(topic_traffic(observation))
    assert traffic == {TOPIC: TopicTraffic(10.0, 1000.0)}
    [row] = topic_rows(observation, own="/page", traffic=traffic)
    assert (row["rate"], row["bandwidth"]) == (10.0, 1000.0)
    assert graph_figures(observation, traffic) == [10.0, 1000.0, 0.0]


def test_the_measurement_of_the_page_is_shown_everywhere() -> None:
    now_s = [0.0]
    observation = observed(TOPIC, TWO_SUBSCRIBERS)
    watch = TopicWatch(TOPIC, RawDecoder(), clock=lambda: now_s[0])
    for number in range(21):
        now_s[0] = number / 20
        message = AnyMsg(bytes(50))
        message._connection_header = {}
        watch.note(message)
    traffic, figures = dict(topic_traffic(observation, [watch])), watch.figures()
    assert traffic[TOPIC] == TopicTraffic(figures["rate"], figures["bandwidth"])
    assert traffic[TOPIC].rate == pytest.approx(20.0)
    [row] = topic_rows(observation, own="/page", traffic=traffic)
    drawn = graph_figures(observation, traffic)
    assert (row["rate"], row["bandwidth"]) == (drawn[0], pytest.approx(drawn[1], abs=0.1))


def test_the_publishers_of_a_topic_are_added() -> None:
    observation = observed(TOPIC, {**TWO_SUBSCRIBERS, ("/b", "/x"): Traffic(5.0, 500.0), ("/b", "/y"): None})
    assert topic_traffic(observation)[TOPIC] == TopicTraffic(15.0, 1500.0)


@pytest.mark.parametrize("topic", ["/tf_static", "/map"])
def test_a_latched_topic_is_not_a_topic_of_rate_zero(topic: str) -> None:
    observation = observed(topic, {("/a", "/x"): Traffic(0.0, 0.0)})
    watch = TopicWatch(topic, RawDecoder())
    message = AnyMsg(b"")
    message._connection_header = {"callerid": "/a", "latching": "1"}
    watch.note(message)
    traffic = dict(topic_traffic(observation, [watch]))
    [row] = topic_rows(observation, traffic=traffic)
    assert (row["rate"], row["latched"]) == (0.0, True)
    assert graph_figures(observation, traffic) == [0.0, 0.0, 0.0, 1.0]
    assert topic_traffic(observation)[topic].is_latched == (topic == "/tf_static")
