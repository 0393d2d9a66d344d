"""Reported faults of rospy nodes: services, parameters, names, times and logs."""

import math
import re
import signal
import socket
import sys
import threading
from collections.abc import Callable
from typing import Any

import pytest
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool

from pipros.basics.errors import InvalidName, NotFound
from pipros.master.master import Master
from pipros.msg.time import Time
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from pipros.node import Node
from pipros.node.clock import TimeMovedBackwards
from pipros.node.rate import Rate, Timer
from pipros.node.service_link import CallTimeout
from pipros.node.timings import NodeTimings
from tests.support.nodes import MakeNode, listening_log, wait_until_connected
from tests.support.processes import Process, Processes
from tests.support.waiting import wait_until


@pytest.fixture
def run(processes: Processes, master: Master) -> Callable[[str], Process]:
    """Run a script of rospy on the master, to its end."""
    variables = {"ROS_MASTER_URI": master.uri}
    return lambda script: processes.run(sys.executable, "-c", script, environment=variables)


# ros_comm#152, #149, roslibpy#27, rosbridge_suite#905: calls waited forever, or failed without a reason.


@pytest.mark.parametrize("persistent", [False, True])
def test_a_call_that_takes_too_long_ends_and_the_next_works(make_node: MakeNode, persistent: bool) -> None:
    server, gate = make_node("server"), threading.Event()

    def handle(request: Any) -> Any:
        if request.data:
            gate.wait(60)
        return SetBool._response_class(success=True)

    server.serve("set", SetBool, handle)
    client = make_node("client").client("set", SetBool, persistent=persistent)
    with pytest.raises(CallTimeout, match=r"service \[/set\] did not answer in time"):
        client.call(SetBool._request_class(data=True), 0.05)
    assert client.call(SetBool._request_class(data=False), 30).success
    client.close()
    gate.set()


def test_a_server_that_accepts_and_never_responds_times_out(make_node: MakeNode, master: Master) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        register = MasterClient(master.uri, "/silent")
        register.register_service(
            "/set", f"rosrpc://127.0.0.1:{silent.getsockname()[1]}", "http://127.0.0.1:1/"
        )
        register.close()
        with pytest.raises(CallTimeout):
            make_node("client").client("set", SetBool).call(SetBool._request_class(), 0.05)


SCRIPT = """
import threading, rospy
from std_srvs.srv import Empty
rospy.init_node("node")
gate = threading.Event()
rospy.Service("hang", Empty, lambda _: (gate.wait(60), [])[1])
rospy.wait_for_service("hang", timeout=30)
for call in (
    lambda: rospy.ServiceProxy("hang", Empty, timeout=0.5)(),
    lambda: rospy.ServiceProxy("hang", Empty).call(timeout=0.5),
):
    try:
        call()
    except rospy.ServiceException as error:
        print(error, flush=True)
gate.set()
"""


def test_rospy_has_time_limits_for_a_proxy_and_for_a_call(run: Callable[[str], Process]) -> None:
    ended = run(SCRIPT)
    assert ended.stdout == ["service [/hang] did not answer in time"] * 2, ended.output


# ros_comm#2288, #2021, #1439, #2181: a cached parameter stayed old for minutes, or reading it hung.


def cached(node: Any, name: str) -> Any:
    """Return the cached value; None when it is not set."""
    try:
        return node.params.get_cached(name)
    except NotFound:
        return None


def test_a_cached_parameter_follows_changes_by_other_nodes(make_node: MakeNode) -> None:
    reader, writer = make_node("reader"), make_node("writer")
    assert cached(reader, "/gains/p") is None
    writer.params.set("/gains/p", 1)
    wait_until(lambda: cached(reader, "/gains/p") == 1)
    assert cached(reader, "/gains") == {"p": 1}
    writer.params.set("/gains", {"p": 2, "d": 3})
    wait_until(lambda: cached(reader, "/gains/p") == 2)
    wait_until(lambda: cached(reader, "/gains") == {"p": 2, "d": 3})
    writer.params.delete("/gains/p")
    wait_until(lambda: cached(reader, "/gains/p") is None)
    wait_until(lambda: cached(reader, "/gains") == {"d": 3})


def test_a_node_sees_its_own_changes_at_once(make_node: MakeNode) -> None:
    node = make_node("node")
    node.params.set("/gains/p", 1)
    assert (cached(node, "/gains/p"), cached(node, "/gains")) == (1, {"p": 1})
    node.params.set("/gains/p", 2)
    assert (cached(node, "/gains/p"), cached(node, "/gains")) == (2, {"p": 2})
    node.params.set("/gains", {"p": 3, "d": 4})
    assert (cached(node, "/gains/p"), cached(node, "/gains")) == (3, {"p": 3, "d": 4})
    node.params.delete("/gains/p")
    assert (cached(node, "/gains/p"), cached(node, "/gains")) == (None, {"d": 4})


def test_an_old_notice_does_not_undo_a_later_change_by_the_node(make_node: MakeNode) -> None:
    node = make_node("node")
    node.params.set("/speed", 1)
    assert cached(node, "/speed") == 1
    node.params.set("/speed", 3)
    with RpcClient(node.uri) as master:
        master.call("paramUpdate", "/master", "/speed/", 2)  # was in transit for longer
    assert cached(node, "/speed") == 3


def test_changes_during_the_first_fetch_count(make_node: MakeNode, monkeypatch: pytest.MonkeyPatch) -> None:
    reader, writer = make_node("reader"), make_node("writer")
    writer.params.set("/speed", 1)
    subscribe = reader.master.subscribe_param
    update, notices = reader.params.update, []

    def note_update(key: str, value: Any) -> bool:
        is_cached = bool(update(key, value))
        notices.append(key)
        return is_cached

    monkeypatch.setattr(reader.params, "update", note_update)

    def subscribe_slowly(api: str, key: str) -> Any:
        value = subscribe(api, key)
        writer.params.set("/speed", 2)
        wait_until(lambda: notices)  # the notification has overtaken the response
        return value

    monkeypatch.setattr(
        type(reader.master), "subscribe_param", lambda _, api, key: subscribe_slowly(api, key)
    )
    assert cached(reader, "/speed") == 2


def test_many_threads_may_read_while_others_write(make_node: MakeNode) -> None:
    node, writer = make_node("node"), make_node("writer")

    def read() -> None:
        for number in range(100):
            cached(node, f"/busy/{number % 7}")

    def write(by: Any) -> None:
        for number in range(50):
            by.params.set(f"/busy/{number % 7}", number)

    threads = [threading.Thread(target=read, daemon=True) for _ in range(4)]
    threads += [threading.Thread(target=write, args=(by,), daemon=True) for by in (node, writer)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not any(thread.is_alive() for thread in threads)
    for number in range(7):
        truth = writer.params.get(f"/busy/{number}")
        wait_until(lambda key=f"/busy/{number}", value=truth: cached(node, key) == value)


# ros_comm#253: `get_param(search_param("x"), default)` did not return the default if nothing was found.


NONE_SCRIPT = """
import rospy
from std_srvs.srv import Empty

def attempt(action, *arguments):
    try:
        print(action.__name__, action(*arguments))
    except Exception as error:
        kind = next(kind for kind in (KeyError, ValueError, Exception) if isinstance(error, kind))
        print(action.__name__, kind.__name__, str(error))

def examine():
    nothing = rospy.search_param("nothing")
    for action in (rospy.get_param, rospy.get_param_cached):
        attempt(action, nothing, "the default")
        attempt(action, nothing)
    for action in (rospy.has_param, rospy.delete_param, rospy.search_param):
        attempt(action, nothing)
    attempt(rospy.set_param, nothing, 1)
    attempt(rospy.ServiceProxy, nothing, Empty)
    attempt(rospy.wait_for_service, nothing, 1)
    for name in (nothing, ""):
        attempt(rospy.Service, name, Empty, print)
    print(rospy.get_published_topics(nothing) == rospy.get_published_topics())

rospy.set_param("/something", 1)
examine()
rospy.init_node("node")
examine()
"""

EXPECTED = [
    "get_param the default", "get_param KeyError 'parameter: a name must be a string, got None'",
    "get_param_cached the default",
    "get_param_cached KeyError 'parameter: a name must be a string, got None'", "has_param False",
    "delete_param KeyError 'parameter: a name must be a string, got None'",
    "search_param ValueError a name must be a string, got None",
    "set_param ValueError a name must be a string, got None",
    "ServiceProxy ValueError a name must be a string, got None",
    "wait_for_service ValueError a name must be a string, got None",
    "Service ValueError service name is not a non-empty string",
    "Service ValueError service name is not a non-empty string", "True",
]  # fmt: skip


def test_none_as_a_name_means_the_default_or_an_error_with_it(run: Callable[[str], Process]) -> None:
    node = run(NONE_SCRIPT)
    assert node.stdout == EXPECTED * 2, node.output


def test_a_node_of_the_library_refuses_names_that_are_not_strings(make_node: MakeNode) -> None:
    node = make_node("node")
    for name in (None, 5, b"x"):
        with pytest.raises(InvalidName, match="a name must be a string, got "):
            node.params.get(name)  # type: ignore[arg-type]


# ros_comm#262: nodes could only be killed with -9 once the master was down.


ORPHAN_SCRIPT = """
import rospy
from std_msgs.msg import String
from std_srvs.srv import Empty
rospy.init_node("node")
rospy.Publisher("a", String, queue_size=1)
rospy.Subscriber("b", String, print)
rospy.Service("c", Empty, lambda _: [])
print("ready", flush=True)
rospy.spin()
"""


def test_ctrl_c_ends_a_node_whose_master_has_died(processes: Processes) -> None:
    with Master(port=0) as master:
        node = processes.start(
            sys.executable, "-c", ORPHAN_SCRIPT, environment={"ROS_MASTER_URI": master.uri}
        )
        node.wait_for("ready")
    node.send_signal(signal.SIGINT)
    node.check(0)


# ros_comm#1083, #492, #156, #2111: simulated time was set back, or had no clock, and loops hung silently.


S = 1_000_000_000


class Simulator:
    """Publish the simulated time."""

    def __init__(self, make_node: MakeNode, node: Node) -> None:
        self.publisher = make_node("simulator").advertise("/clock", Clock, queue_size=10)
        self.node = node
        wait_until_connected(self.publisher)

    def set(self, seconds: float) -> None:
        self.publisher.publish(Clock(Time.from_sec(seconds)))
        wait_until(lambda: self.node.clock.now_ns() == int(seconds * S))


@pytest.fixture
def node(make_node: MakeNode) -> Node:
    node = make_node("node")
    node.use_simulated_time()
    return node


def test_a_sleeper_is_notified_when_time_is_set_back(make_node: MakeNode, node: Node) -> None:
    simulator, told = Simulator(make_node, node), []
    simulator.set(100)

    def sleep() -> None:
        try:
            node.clock.sleep(10)
        except TimeMovedBackwards as error:
            told.append(error.jump_s)

    sleeper = threading.Thread(target=sleep, daemon=True)
    sleeper.start()
    wait_until(lambda: simulator.set(101) or told or sleeper.is_alive())
    # A thread that is not sleeping yet misses the jump, so jumps are repeated until it sleeps.
    wait_until(lambda: simulator.set(50) or simulator.set(51) or told)
    assert told[0] < 0


def turn(node: Node, turns: list[float]) -> None:
    rate = Rate(node.clock, S, reset=True)
    while rate.sleep():
        turns.append(node.clock.now_ns() / S)


def repeat_by_timer(node: Node, turns: list[float]) -> None:
    Timer(node.clock, S, lambda tick: turns.append(tick.current_real_ns / S), reset=True)


@pytest.mark.parametrize("repeat", [turn, repeat_by_timer], ids=["loop", "timer"])
def test_what_repeats_with_reset_continues_after_time_was_set_back(make_node, node: Node, repeat) -> None:
    simulator, turns = Simulator(make_node, node), []
    simulator.set(1000)
    threading.Thread(target=repeat, args=(node, turns), daemon=True).start()
    ticks = iter(range(1001, 10_000))
    wait_until(lambda: simulator.set(next(ticks)) or len(turns) >= 3)
    simulator.set(10)
    ticks = iter(range(11, 1000))
    wait_until(lambda: simulator.set(next(ticks)) or (turns[-1] > 12 and turns[-1] < 1000))


def test_a_sleeper_without_a_clock_gets_a_warning(make_node: MakeNode) -> None:
    log, lines = listening_log()
    node = make_node("node", log=log, timings=NodeTimings(clock_silence_s=0.05))
    node.use_simulated_time()
    threading.Thread(target=node.clock.sleep, args=(1,), daemon=True).start()
    wait_until(lambda: lines)
    assert "/clock" in lines[0]
    assert "/use_sim_time" in lines[0]


# ros_comm#2257: a `rospy.Timer` ended when `rosbag play --loop` began again.


TIMER_SCRIPT = """
import threading
import rospy
from rosgraph_msgs.msg import Clock

rospy.init_node("node")
clock = rospy.Publisher("/clock", Clock, queue_size=10)
times = []

def play(start, enough):
    for seconds in range(start, start + 1000):
        clock.publish(Clock(rospy.Time(seconds)))
        threading.Event().wait(0.002)
        if enough():
            return
    raise SystemExit("the timer did not run")

while not clock.get_num_connections():
    threading.Event().wait(0.01)
timer = rospy.Timer(rospy.Duration(1), lambda event: times.append(event.current_real.secs))
play(5000, lambda: len(times) > 3)
play(10, lambda: sum(time < 4000 for time in times) > 3)
print(timer.is_alive())
rospy.signal_shutdown("done")
"""


def test_a_timer_goes_on_when_a_bag_begins_again(run: Callable[[str], Process], master: Master) -> None:
    client = MasterClient(master.uri, "/test")
    client.set_param("/use_sim_time", True)
    client.close()
    node = run(TIMER_SCRIPT)
    assert node.stdout == ["True"], node.output


# ros_comm#2370: `%f` in the times of `ROSCONSOLE_FORMAT` was printed as it is.


LOGGED_SCRIPT = 'import rospy; rospy.init_node("node"); rospy.loginfo("x")'


@pytest.mark.parametrize("name", ["time", "walltime"])
def test_times_of_log_lines_can_have_microseconds(processes: Processes, master: Master, name: str) -> None:
    variables = {
        "ROS_MASTER_URI": master.uri, "ROSCONSOLE_FORMAT": f"[${{{name}:%H:%M:%S.%f %%f}}] ${{message}}",
    }  # fmt: skip
    node = processes.run(sys.executable, "-c", LOGGED_SCRIPT, environment=variables)
    (line,) = node.stdout
    assert re.fullmatch(r"\[\d\d:\d\d:\d\d\.\d{6} %f\] x", line)


# ros_comm: one bad callback, handler, hook, message or parameter took the good ones beside it along.


BAD_SCRIPT = """
import time

import rospy
from std_msgs.msg import Int32
from std_srvs.srv import SetBool, SetBoolResponse

def wait(condition):
    end = time.monotonic() + 30
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)

def on_message(number):
    def callback(message):
        got.append((message.data, number))
        if number == 1:
            subscribers[1].unregister()
        if number == 0:
            raise ValueError("bad callback")
    return callback

rospy.init_node("node")
got, hooks = [], []
subscribers = [rospy.Subscriber("topic", Int32, on_message(number)) for number in range(4)]
publisher = rospy.Publisher("topic", Int32, queue_size=10)
wait(publisher.get_num_connections)
for value in (1, 2**40, "x", 2):
    try:
        publisher.publish(value)
    except rospy.ROSException as error:
        print("publish:", type(error).__name__)
wait(lambda: len(got) == 7)
print(sorted(got))

answers = iter([None, "text", [True], SetBoolResponse(True, "good"), {"success": True}])
rospy.Service("set", SetBool, lambda request: next(answers))
proxy = rospy.ServiceProxy("set", SetBool, persistent=True)
for _ in range(6):
    try:
        print("call:", proxy(True).success)
    except rospy.ServiceException:
        print("call: failed")

def bad_hook():
    raise RuntimeError("bad hook")

for hook in (lambda: hooks.append(1), bad_hook, lambda: hooks.append(2)):
    rospy.on_shutdown(hook)
rospy.signal_shutdown("end")
print(hooks)
"""


def test_what_is_beside_a_bad_one_goes_on(run: Callable[[str], Process]) -> None:
    node = run(BAD_SCRIPT)
    assert [line for line in node.stdout if line.startswith(("publish:", "call:", "["))] == [
        *["publish: ROSSerializationException"] * 2,
        "[(1, 0), (1, 1), (1, 2), (1, 3), (2, 0), (2, 2), (2, 3)]",
        *["call: failed", "call: failed", "call: failed", "call: True", "call: True", "call: failed"],
        "[1, 2]",
    ], node.output


def test_a_parameter_that_cannot_be_sent_changes_nothing(make_node: MakeNode) -> None:
    params = make_node("node").params
    good = {"küche": "ü🤖", "a/b": math.inf, "": [], "empty": {}, "nan": -math.inf, "tab": "a\t b "}
    params.set("/good", good)
    for bad in ({"x": 1, "y": None}, {"x": 2**31}, {"x": "a\0b"}, {1: 2}, ["\udcff"]):
        with pytest.raises((TypeError, ValueError, OverflowError)):
            params.set("/good", bad)
    assert params.get("/good") == good
