"""The rate and bandwidth of a topic, which all views share."""

from __future__ import annotations

import pytest

from pipros.node.any_msg import AnyMsg
from pipros_page.topic_watch import TopicWatch
from pipros_page.traffic import TopicTraffic, topic_traffic
from pipros_page.views.graph_values import traffic_values
from pipros_page.views.topics import topic_rows
from pipros_tools.graph.drawing.grouping import Grouping, grouped
from pipros_tools.graph.drawing.node_graph import GraphOptions, node_graph
from pipros_tools.graph.drawing.scene import draw
from pipros_tools.graph.observer import GraphObservation, Traffic
from pipros_tools.graph.raw_decoder import RawDecoder
from pipros_tools.graph.system_state import SystemState, TopicConnection

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
    assert drawn is not None
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
