"""Fleet links that are cut, routers that are restarted, and members that are killed."""

import itertools
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager

import pytest

from pipros.msg import load_message_class
from pipros.net.loop import BackgroundLoop
from pipros_fleet import keys
from pipros_fleet.zenoh_connecting import connect, open_router
from pipros_fleet.zenoh_session import LinkFailed
from pipros_tools.testing.faults.tcp_proxy import Switch, TcpProxy
from tests.graph.test_fleet_topics import publish_until
from tests.support.fleet import LIMIT_S, Member, String, link_to, running_router
from tests.support.narrow_link import THERE, NarrowLink
from tests.support.network import needs_network
from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

TYPES = (
    "actionlib_msgs/GoalStatusArray", "actionlib_msgs/GoalStatus", "actionlib/TestActionResult",
    "actionlib/TestResult",
)  # fmt: skip


class Cable:
    """A link through a proxy.

    Attributes:
        address: where the member connects.
    """

    def __init__(self, port: int) -> None:
        self._loop = BackgroundLoop("cable")
        self._loop.start()
        self._switch = Switch()
        self._proxy = TcpProxy("cable", ("127.0.0.1", port), self._switch)
        self._loop.run(self._proxy.start())
        self.address = f"tcp/127.0.0.1:{self._proxy.address[1]}"

    def stall(self, *, stall: bool = True) -> None:
        """Stop or resume forwarding in both directions, like pulling or plugging a cable."""
        self._loop.call(lambda: self._switch.stall(stall=stall))

    def cut(self) -> None:
        """Reset the connections."""
        self._loop.call(self._switch.cut)

    def close(self) -> None:
        self._loop.call(self._proxy.close)
        self._loop.stop()


@contextmanager
def cable_to(port: int) -> Iterator[Cable]:
    with closing(Cable(port)) as cable:
        yield cable


def test_a_pulled_cable_delays_no_local_node_and_what_is_lost_is_counted(claimed_port: ClaimedPort) -> None:
    port = claimed_port.number
    with (
        running_router(port) as router,
        cable_to(port) as cable,
        Member("operator", router) as operator,
        Member("robot1", cable.address) as robot,
    ):
        talker = robot.node("talker").advertise("/chatter", String, queue_size=None)
        state = robot.node("map").advertise("/map", String, latch=True)
        state.publish(String("old map"))
        at_home = robot.receive("/chatter", name="local")
        operator.wait_for_topic("/robot1/chatter")
        received = operator.receive("/robot1/chatter")
        maps = operator.receive("/robot1/map", name="maps")
        publish_until(talker, received, "before")
        wait_until(lambda: [each.data for each in maps] == ["old map"], LIMIT_S, "the map")

        cable.stall()
        wait_until(lambda: not robot.link.is_connected, LIMIT_S, "the robot to notice")
        state.publish(String("new map"))
        wait_until(lambda: not robot.agent.sender.is_up, LIMIT_S, "the agent to notice")
        for number in range(100):
            talker.publish(String(f"away {number}"))

        def unsent() -> int:
            rows = robot.agent.statistics()["sent"].items()
            return next(row[3] for key, row in rows if key.endswith("chatter"))

        wait_until(
            lambda: sum(each.data.startswith("away") for each in at_home) == 100,
            LIMIT_S,
            "all messages at the local node",
        )
        wait_until(lambda: unsent() >= 100, LIMIT_S, "all messages in the counters")

        cable.stall(stall=False)
        cable.cut()
        publish_until(talker, received, "after")
        wait_until(lambda: maps[-1].data == "new map", LIMIT_S, "the new map")


def test_a_router_that_is_restarted_joins_all_again(claimed_port: ClaimedPort) -> None:
    address = f"tcp/127.0.0.1:{claimed_port.number}"
    router = open_router([address])
    with Member("robot1", address) as robot, Member("operator", address) as operator:
        talker = robot.node("talker").advertise("/chatter", String, queue_size=None)
        operator.wait_for_topic("/robot1/chatter")
        received = operator.receive("/robot1/chatter")
        publish_until(talker, received, "before")
        router.close()
        wait_until(lambda: not robot.agent.sender.is_up, LIMIT_S, "the robot to notice")
        for number in range(20):
            talker.publish(String(f"away {number}"))
        wait_until(
            lambda: sum(row[3] for row in robot.agent.statistics()["sent"].values()) >= 20,
            LIMIT_S,
            "the messages to be discarded",
        )
        assert "/robot1/chatter" in operator.state().publishers, "names stay while there is no router"
        with closing(open_router([address])) as router:
            publish_until(talker, received, "after")
            counts = operator.agent.statistics()["received"]["robot1 /robot1/chatter"]
            assert counts[2] >= 20, f"what was lost is counted, got {counts}"


def test_messages_latched_during_a_short_cut_arrive(claimed_port: ClaimedPort) -> None:
    """The link is restored before the other members or the next poll can notice."""
    address = f"tcp/127.0.0.1:{claimed_port.number}"
    router = open_router([address])
    with Member("robot1", address) as robot, Member("operator", address) as operator:
        state = robot.node("map").advertise("/map", String, latch=True)
        state.publish(String("old"))
        operator.wait_for_topic("/robot1/map")
        maps = operator.receive("/robot1/map")
        wait_until(lambda: maps, LIMIT_S, "the map")
        router.close()
        state.publish(String("new"))
        with closing(open_router([address])) as router:
            wait_until(lambda: maps[-1].data == "new", LIMIT_S, "the new map")


def test_a_member_that_returns_while_the_link_is_down_is_shown_again(claimed_port: ClaimedPort) -> None:
    port = claimed_port.number
    with (
        running_router(port) as router,
        cable_to(port) as cable,
        Member("operator", cable.address) as operator,
    ):
        with Member("robot1", router) as robot:
            robot.node("talker").advertise("/old", String)
            operator.wait_for_topic("/robot1/old")
            with Member("robot2", router) as gone:
                gone.node("talker").advertise("/x", String)
                operator.wait_for_topic("/robot2/x")
                cable.stall()
                wait_until(lambda: not operator.agent.sender.is_up, LIMIT_S, "the operator to notice")
        with Member("robot1", router) as robot:
            talker = robot.node("talker").advertise("/new", String)
            cable.stall(stall=False)
            cable.cut()
            operator.wait_for_topic("/robot1/new")
            publish_until(talker, operator.receive("/robot1/new"), "hello")
            wait_until(
                lambda: "/robot1/old" not in operator.state().publishers, LIMIT_S, "the old topic to go"
            )
            wait_until(lambda: "/robot2/x" not in operator.state().publishers, LIMIT_S, "robot2 to go")


@pytest.mark.parametrize("cut", ["robot1", "operator"])
@pytest.mark.parametrize("leaves", [True, False], ids=["left", "stayed"])
def test_a_result_of_a_cut_arrives_once_and_before_a_status_without_its_goal(
    claimed_port: ClaimedPort, cut: str, leaves: bool
) -> None:
    """A client gives its goal up as lost if a status lacks it before its result came."""
    port, feedback = claimed_port.number, load_message_class("actionlib/TestActionFeedback")
    status, goal, result, outcome = map(load_message_class, TYPES)
    with running_router(port) as router, cable_to(port) as cable, ExitStack() as stack:
        robot, operator = (
            stack.enter_context(Member(name, cable.address if name == cut else router))
            for name in ("robot1", "operator")
        )
        server = robot.node("server")
        publishers = {
            name: server.advertise(f"/do/{name}", kind, queue_size=None)
            for name, kind in (("status", status), ("feedback", feedback), ("result", result))
        }
        operator.wait_for_topic("/robot1/do/status")
        arrived: list[str] = []
        client = operator.node("client")
        client.subscribe(
            "/robot1/do/status", status, lambda got: arrived.append(f"{len(got.status_list)} goals")
        )
        client.subscribe(
            "/robot1/do/result", result, lambda got: arrived.append(f"result {got.result.result}")
        )

        def passes(text: str, goals: int) -> bool:
            publishers["status"].publish(status(status_list=[goal()] * goals))
            return text in arrived

        wait_until(lambda: passes("1 goals", 1), LIMIT_S, "the goal's status", 0.05)
        wait_until(
            lambda: publishers["result"].connection_count, LIMIT_S, "the agent to subscribe to results"
        )
        publishers["result"].publish(result(result=outcome(1)))
        wait_until(lambda: "result 1" in arrived, LIMIT_S, "a result before the cut")

        cable.stall()
        member, other = (robot, operator) if cut == "robot1" else (operator, robot)
        wait_until(lambda: not member.agent.sender.is_up, LIMIT_S, "the member to notice")
        if leaves:
            wait_until(lambda: not other.link.live_keys(keys.live(cut), 1.0), LIMIT_S, "the member to leave")
        publishers["result"].publish(result(result=outcome(2)))
        for _ in range(20):
            passes("", 0)
        cable.stall(stall=False)
        cable.cut()
        wait_until(lambda: passes("result 2", 0), LIMIT_S, lambda: f"the result, got {arrived}", 0.05)
        wait_until(lambda: passes("0 goals", 0), LIMIT_S, "later statuses", 0.05)
        assert arrived.index("result 2") < arrived.index("0 goals")
        publishers["result"].publish(result(result=outcome(3)))
        wait_until(lambda: "result 3" in arrived, LIMIT_S, "a result after the cut")
        assert [each for each in arrived if "result" in each] == ["result 1", "result 2", "result 3"]

        with Member("late", router) as late:
            late.wait_for_topic("/robot1/do/result")
            results = late.receive("/robot1/do/result", result)

            def is_linked() -> bool:
                publishers["result"].publish(result(result=outcome(4)))
                return bool(results)

            wait_until(is_linked, LIMIT_S, "a result that is new")
            assert {each.result.result for each in results} == {4}, "old results are for members that return"


def test_a_killed_member_disappears_and_its_successor_takes_the_name(
    ros: RosSystem, claimed_port: ClaimedPort
) -> None:
    ros.serve_master()
    port = ClaimedPort()
    with running_router(port.number) as address, Member("operator", address) as operator:
        talker = ros.pipros.start("rostopic", "pub", "-r", "20", "/chatter", "std_msgs/String", "alive")
        first = ros.pipros.start("pipros", "fleet", "join", "robot1", "--router", address)
        operator.wait_for_topic("/robot1/chatter")
        received = operator.receive("/robot1/chatter")
        wait_until(lambda: received, LIMIT_S, "a message")
        first.kill()
        wait_until(lambda: "/robot1/chatter" not in operator.state().publishers, LIMIT_S, "the topic to go")
        count = len(received)
        ros.pipros.start("pipros", "fleet", "join", "robot1", "--router", address)
        wait_until(lambda: len(received) > count, LIMIT_S, "messages of the successor")
        assert talker.is_running
    port.release()


def test_closing_a_link_does_not_wait_for_a_silent_router(claimed_port: ClaimedPort) -> None:
    port = claimed_port.number
    with running_router(port), cable_to(port) as cable:
        member = Member("robot1", cable.address)
        cable.stall()
        closer = threading.Thread(target=member.close)
        closer.start()
        closer.join(30)
        assert not closer.is_alive()


def test_a_member_that_does_not_read_delays_no_other(claimed_port: ClaimedPort) -> None:
    port = claimed_port.number
    with (
        running_router(port) as router,
        cable_to(port) as cable,
        Member("robot1", router) as robot,
        Member("operator", router) as operator,
        Member("slow", cable.address) as slow,
    ):
        talker = robot.node("talker").advertise("/images", String)
        for member in (operator, slow):
            member.wait_for_topic("/robot1/images")
        received, at_slow = operator.receive("/robot1/images"), slow.receive("/robot1/images")
        publish_until(talker, received, "first")
        publish_until(talker, at_slow, "first")
        cable.stall()
        image = "x" * 200_000
        numbers = itertools.count()

        def next_arrives() -> bool:
            talker.publish(String(f"{next(numbers)} {image}"))
            return len(received) > 100

        wait_until(next_arrives, LIMIT_S, "a hundred images at the other operator")


def test_a_masters_restart_does_not_end_the_membership(ros: RosSystem, claimed_port: ClaimedPort) -> None:
    port = ClaimedPort()
    core = ros.pipros.start_bare_master()
    with (
        running_router(port.number) as address,
        Member("operator", address) as operator,
        Member("robot1", address, master_uri=ros.master_uri) as robot,
    ):
        talker = robot.node("talker").advertise("/chatter", String)
        operator.wait_for_topic("/robot1/chatter")
        received = operator.receive("/robot1/chatter")
        publish_until(talker, received, "before")
        core.press_ctrl_c()
        core.wait()
        ros.pipros.start_bare_master()
        ros.wait_for_publisher("/chatter")
        publish_until(talker, received, "after")
    port.release()


def test_commands_overtake_images_on_a_narrow_link(claimed_port: ClaimedPort) -> None:
    """Sending all images takes 20 s; a command does not wait for them."""
    file = """
    bandwidth_kbit: 400
    share:
      topics:
        - {name: /images, priority: low}
        - {name: /stop, priority: high}
    """
    port = claimed_port.number
    with (
        running_router(port) as router,
        Member("robot1", router, file) as robot,
        Member("operator", router) as operator,
    ):
        node = robot.node("robot")
        images, stop = node.advertise("/images", String), node.advertise("/stop", String)
        for topic in ("/robot1/images", "/robot1/stop"):
            operator.wait_for_topic(topic)
        seen, stopped = (
            operator.receive("/robot1/images", name="eye"),
            operator.receive("/robot1/stop", name="hand"),
        )
        publish_until(images, seen, "first")
        publish_until(stop, stopped, "first")
        before = len(seen)
        for _ in range(20):
            images.publish(String("image" + "x" * 50_000))
        publish_until(stop, stopped, "now")
        assert len(seen) < before + 20, "the images still wait"


@needs_network
@pytest.mark.timeout(500)  # waits for browser tests
def test_a_member_joins_over_a_slow_link_that_loses_packets(ros: RosSystem) -> None:
    """Round trips take 0.6 s, and one packet in twenty is lost."""
    with NarrowLink(kbit=1000, delay_s=0.3, loss=0.05) as narrow:
        address = f"tcp/{THERE}:7447"  # no other program is in the namespace
        command = [*narrow.prefix, "pipros", "fleet", "router", address, "--without-tls"]
        ros.pipros.start(*command).wait_for("router at")
        link = link_to(address)
        assert link.is_connected
        link.close()


def test_a_router_that_does_not_answer_is_reported_with_the_time_that_was_waited() -> None:
    waited = r"waited 1\.\d s for the handshake, after a TCP connection in 0\.\d\d s"
    with socket.create_server(("127.0.0.1", 0)) as silent, pytest.raises(LinkFailed, match=waited):
        connect(f"tcp/127.0.0.1:{silent.getsockname()[1]}")
    with pytest.raises(LinkFailed, match="Connection refused"):
        connect("tcp/127.0.0.1:1")
