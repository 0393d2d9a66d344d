"""Genuine nodes and pipros nodes that communicate through the fault proxy."""

from collections.abc import Iterator, Sequence

import pytest
from std_msgs.msg import String

from pipros.basics.env import Environment
from pipros.node import Node
from pipros.node.timings import NodeTimings
from pipros_tools.testing.faults.history import History
from pipros_tools.testing.faults.ros_proxy import FaultProxy
from tests.support.environments import VENV_BIN
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

LIMIT_S = 60.0
QUICK_RETRIES = NodeTimings(retry_longest_s=0.2)

TALKER = """
import itertools, rospy, zlib
from std_msgs.msg import String
rospy.init_node("talker")
publisher, rate = rospy.Publisher("chat", String, queue_size=10), rospy.Rate(200)
for number in itertools.count(1):
    if rospy.is_shutdown():
        break
    publisher.publish("rospy %d %08x " % (number, zlib.crc32(b"rospy %d " % number)))
    rate.sleep()
"""
RELAY = """
import rospy
from std_msgs.msg import String
rospy.init_node("relay")
publisher = rospy.Publisher("back", String, queue_size=1000)
rospy.Subscriber("chat", String, publisher.publish)
rospy.spin()
"""
PEERS = {
    "rospy": ("/usr/bin/python3", "-c", RELAY),
    "roscpp": ("rosrun", "topic_tools", "relay", "/chat", "/back"),
    "pipros": (str(VENV_BIN / "python"), "-c", RELAY),
}


class Scene:
    """A node of pipros, a relay behind the proxy, and a history of the messages in both directions."""

    def __init__(self, ros: RosSystem, proxy: FaultProxy, peer: Sequence[str]) -> None:
        self.history = History()
        side = ros.pipros if str(VENV_BIN) in peer[0] else ros.genuine
        self.relay = side.start(*peer, ROS_MASTER_URI=proxy.uri)
        self.node = Node("near", environment=Environment(master_uri=ros.master_uri), timings=QUICK_RETRIES)
        self.node.start()
        self.back = self.node.subscribe("back", String, lambda message: self.history.receive(message.data))
        self.there = self.node.advertise("chat", String, queue_size=0)
        self.say_until_one_comes()
        # The relay may have dropped some of these: topic_tools' has queues of 10. The last one returns.
        wait_until(lambda: self.history.last("near") == self.history.sent("near"), LIMIT_S)
        self.history = History()

    def say(self, size: int = 0) -> None:
        self.there.publish(String(self.history.next_text("near", size)))

    def say_until_one_comes(self) -> None:
        before = self.history.last("near")

        def comes() -> bool:
            self.say()
            return self.history.last("near") > before

        wait_until(comes, LIMIT_S, lambda: self.relay.output)

    def say_and_wait(self, count: int, size: int = 0) -> None:
        """Send this number of messages, few at a time (topic_tools' relay has queues of 10); wait for all."""
        for _ in range(count):
            wait_until(lambda: self.history.sent("near") - self.history.last("near") < 8, LIMIT_S)
            self.say(size)
        wait_until(lambda: self.history.last("near") == self.history.sent("near"), LIMIT_S)


@pytest.fixture
def proxy(plain_ros: RosSystem) -> Iterator[FaultProxy]:
    plain_ros.genuine.start_bare_master()
    with FaultProxy(plain_ros.master_uri, seed=16) as running:
        yield running


@pytest.fixture(params=PEERS)
def scene(request: pytest.FixtureRequest, plain_ros: RosSystem, proxy: FaultProxy) -> Iterator[Scene]:
    found = Scene(plain_ros, proxy, PEERS[request.param])
    yield found
    found.node.shutdown("end of the test")


def test_all_messages_return_over_a_bad_network(scene: Scene, proxy: FaultProxy) -> None:
    proxy.inject("topics", "nodes", "master", split_bytes=40, jitter_s=0.0005)
    scene.say_and_wait(300, size=100)
    proxy.inject(stall_every_bytes=100_000, stall_s=0.05)
    scene.say_and_wait(300, size=1000)

    assert (scene.history.problems(), scene.history.received) == ([], 600)


@pytest.mark.parametrize("scene", ["roscpp", "pipros"], indirect=True)
def test_cut_links_are_reopened(scene: Scene, proxy: FaultProxy) -> None:
    for _ in range(5):
        for _ in range(20):
            scene.say(size=100)
        # A message may still have come over the link that was cut before. Then no link may be open again yet.
        wait_until(lambda: proxy.cut() >= 1, LIMIT_S)
        scene.say_until_one_comes()

    # Messages in transit on a cut link are lost, on either side of the relay.
    assert scene.history.problems(breaks=10) == []


@pytest.mark.parametrize("reset", [True, False])
def test_a_cut_link_to_a_rospy_publisher_is_reopened(plain_ros, proxy: FaultProxy, reset: bool) -> None:
    """In one trial, a subscriber of rospy got no message for 8 s after this."""
    plain_ros.genuine.start("/usr/bin/python3", "-c", TALKER, ROS_MASTER_URI=proxy.uri)
    history = History()
    environment = Environment(master_uri=plain_ros.master_uri)
    with Node("near", environment=environment, timings=QUICK_RETRIES) as node:
        subscriber = node.subscribe("chat", String, lambda message: history.receive(message.data))
        for cuts in range(4):
            before = history.received
            wait_until(lambda before=before: history.received > before + 10, LIMIT_S)
            assert proxy.cut(reset=reset) == 1
            wait_until(lambda cuts=cuts: subscriber.statistics()["links_ended"] == cuts + 1, LIMIT_S)

    assert history.problems(breaks=4) == []
