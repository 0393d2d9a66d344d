"""The graph of the page equals that of genuine rosgraph for the same system."""

import json
import random
import threading
import time
from collections import Counter
from collections.abc import Iterator
from socketserver import ThreadingMixIn
from typing import Any
from xmlrpc.client import MultiCall, ServerProxy
from xmlrpc.server import MultiPathXMLRPCServer, SimpleXMLRPCDispatcher, SimpleXMLRPCRequestHandler

import pytest

from pipros.net.master_client import MasterClient
from pipros_tools.graph.drawing.node_graph import GraphOptions, node_graph
from pipros_tools.graph.drawing.scene import draw
from pipros_tools.graph.observer import GraphObservation, SystemObserver
from tests.support.environments import file_of_tests
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SCRIPT = file_of_tests("interop/programs/edges_of_graph.py")
NODES, TOPICS = 300, 1000
EVERYTHING = GraphOptions("all", hide_dead_sinks=False, hide_leaf_topics=False, hide_debug=False)
CONNECTED = GraphOptions("active", hide_debug=False)
NODES_ONLY = GraphOptions("nodes", hide_debug=False)


def genuine_edges(ros: RosSystem) -> dict[str, Any]:
    done = ros.genuine.run("/usr/bin/python3", SCRIPT, timeout_s=240)
    assert done.returncode == 0, done.output
    found: dict[str, Any] = json.loads(done.stdout[-1])
    return found


def edges_without_bad_nodes(ros: RosSystem) -> dict[str, Any] | None:
    edges = genuine_edges(ros)
    return None if edges["bad"] else edges


def observe(ros: RosSystem, nodes: int) -> GraphObservation:
    """Poll until all nodes have responded or failed, as the page does: at most 60 nodes each time."""
    observer = SystemObserver(MasterClient(ros.master_uri, "/page", timeout_s=30))
    observation = observer.poll()
    for _ in range(nodes // 50):
        observation = observer.poll()
    return observation


def arrows(observation: GraphObservation, options: GraphOptions) -> list[list[str]]:
    graph = node_graph(observation.state, observation.connections, observation.unreachable, options)
    return sorted([" ".join(arrow.start), " ".join(arrow.end), arrow.topic] for arrow in graph.arrows)


def of_genuine(edges: list[list[str]]) -> list[list[str]]:
    """Convert genuine edges between nodes and topics, marked by a space, to arrows of the page."""
    return sorted(
        [_key(start), _key(end), start[1:] if start.startswith(" ") else end[1:]] for start, end, _ in edges
    )


def _key(name: str) -> str:
    return f"topic {name[1:]}" if name.startswith(" ") else f"node {name}"


@pytest.mark.timeout(400)
def test_the_case_study(ros: RosSystem) -> None:
    ros.pipros.start_master()
    ros.pipros.start("rosrun", "composiv_tryouts", "composiv_talker.py", "__name:=talker")
    ros.genuine.start_node("cpp_battery", "battery_talker")
    for side, name in ((ros.pipros, "listener"), (ros.genuine, "genuine_listener")):
        side.start_node("composiv_tryouts", "composiv_listener.py", f"__name:={name}")
    ros.genuine.start_node("cpp_battery", "battery_listener")
    wait_until(lambda: len(ros.publishers("/battery_topic")) == 2, 30, "two publishers")
    wait_until(lambda: len(ros.subscribers("/battery_topic")) == 3, 30, "three subscribers")

    def complete() -> GraphObservation | None:
        found = observe(ros, 6)
        links = Counter(connection.topic for connection in found.connections)
        is_complete = links == {"/battery_topic": 6, "/rosout": 5} and not found.unreachable
        return found if is_complete else None

    observation = wait_until(complete, 120, "all to be connected")
    assert observation is not None
    # Genuine ROS skips a node that does not answer within a second.
    genuine = wait_until(lambda: edges_without_bad_nodes(ros), 120, "all nodes to answer in time")
    assert genuine is not None
    ours = sorted([each.publisher, each.subscriber, each.topic] for each in observation.connections)
    assert (ours, sorted(observation.nodes)) == (genuine["connections"], genuine["nodes"])
    assert observation.unreachable == set(genuine["bad"]) == set()
    assert arrows(observation, EVERYTHING) == of_genuine(genuine["registered"])
    assert arrows(observation, CONNECTED) == of_genuine(genuine["topics"])
    assert [arrow[:2] for arrow in arrows(observation, NODES_ONLY)] == sorted(
        [f"node {start}", f"node {end}"] for start, end, _ in genuine["connections"]
    )


class RandomSystem:
    """Nodes with only `getBusInfo` and `getBusStats`, and random topics between them.

    A connection is reported by one end or by both. Some topics have no publisher, others have no subscriber,
    and some nodes are dead.
    """

    def __init__(self, seed: int) -> None:
        chance = random.Random(seed)  # noqa: S311 - the same graph each time
        self.publishers: dict[str, set[int]] = {}
        self.subscribers: dict[str, set[int]] = {}
        self.dead = set(chance.sample(range(NODES), 5))
        self.rows: dict[int, list[list[Any]]] = {node: [] for node in range(NODES)}
        self.connections: list[list[str]] = []
        self._server = _Server(("127.0.0.1", 0), _Handler, logRequests=False)
        self.port = self._server.server_address[1]
        for number in range(TOPICS):
            topic = f"/topic{number}"
            self.publishers[topic] = set(chance.choices(range(NODES), k=chance.choice((0, 1, 1, 1, 2))))
            self.subscribers[topic] = set(chance.choices(range(NODES), k=chance.choice((0, 1, 1, 2, 4))))
            for publisher in self.publishers[topic]:
                for subscriber in self.subscribers[topic]:
                    self._connect(topic, publisher, subscriber, chance)
        for node in range(NODES):
            dispatcher = SimpleXMLRPCDispatcher()
            dispatcher.register_function(lambda _, node=node: [1, "", self.rows[node]], "getBusInfo")
            dispatcher.register_function(lambda _: [1, "", [[], [], []]], "getBusStats")
            self._server.add_dispatcher(f"/node{node}/", dispatcher)
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def _connect(self, topic: str, publisher: int, subscriber: int, chance: random.Random) -> None:
        is_up = chance.random() < 0.8
        number = len(self.connections)
        self.rows[subscriber].append([number, self.uri(publisher), "i", "TCPROS", topic, is_up])
        if chance.random() < 0.5:
            self.rows[publisher].append([number, f"/node{subscriber}", "o", "TCPROS", topic, is_up])
        if is_up:
            self.connections.append([f"/node{publisher}", f"/node{subscriber}", topic])

    def uri(self, node: int) -> str:
        return f"http://127.0.0.1:{9 if node in self.dead else self.port}/node{node}/"

    def register(self, master: ServerProxy) -> None:
        calls = MultiCall(master)
        for topics, method in (
            (self.publishers, "registerPublisher"),
            (self.subscribers, "registerSubscriber"),
        ):
            for topic, nodes in topics.items():
                for node in sorted(nodes):
                    getattr(calls, method)(f"/node{node}", topic, "std_msgs/String", self.uri(node))
        assert all(result[0] == 1 for result in calls())

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()


def _with_dead(observation: GraphObservation, dead: set[str]) -> GraphObservation | None:
    return observation if observation.unreachable == dead else None


class _Server(ThreadingMixIn, MultiPathXMLRPCServer):
    daemon_threads = True
    request_queue_size = 100


class _Handler(SimpleXMLRPCRequestHandler):
    rpc_paths = ()  # each node has its own


@pytest.fixture
def random_system() -> Iterator[RandomSystem]:
    system = RandomSystem(20)
    yield system
    system.close()


@pytest.mark.timeout(600)  # either side may take minutes on a busy machine
def test_300_nodes_and_1000_topics(plain_ros: RosSystem, random_system: RandomSystem) -> None:
    plain_ros.serve_master()
    with ServerProxy(plain_ros.master_uri) as master:
        random_system.register(master)
    dead = {f"/node{node}" for node in random_system.dead}
    # On a busy machine, a node may miss the deadline of either side. pipros retries; genuine ROS skips the
    # node.
    observation = wait_until(
        lambda: _with_dead(observe(plain_ros, NODES), dead), 200, "only the dead to fail"
    )
    genuine = genuine_edges(plain_ros)
    silent = set(genuine["bad"])
    assert dead <= silent
    assert sorted(observation.nodes) == genuine["nodes"]

    # Genuine rqt_graph learns about a connection only from the subscriber.
    ours = sorted([each.publisher, each.subscriber, each.topic] for each in observation.connections)
    assert [each for each in ours if each[1] not in silent] == genuine["connections"]
    assert [each for each in ours if each[1] not in dead] == sorted(
        each for each in random_system.connections if each[1] not in dead
    )
    assert len(ours) > 1000
    assert arrows(observation, EVERYTHING) == of_genuine(genuine["registered"])

    graph = node_graph(observation.state, observation.connections, observation.unreachable, EVERYTHING)
    begin_s = time.perf_counter()
    scene = draw(graph)
    elapsed_s = time.perf_counter() - begin_s
    print(f"{len(graph.vertices)} vertices, {len(graph.arrows)} arrows: laid out in {elapsed_s:.2f} s")
    assert len(scene.boxes) == len(graph.vertices) >= 1200
    assert elapsed_s < 30  # 2 s on an idle machine
