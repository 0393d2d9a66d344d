"""A rospy process from start to end: signals, exit codes, registrations, and a second node."""

import functools
import os
import signal
import sys
from collections.abc import Callable

import pytest

from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from tests.support.ports import ClaimedPort
from tests.support.processes import INTERRUPTED, Process, Processes
from tests.support.waiting import wait_until

# A rospy process from start to end: signals at any moment, exit codes, and no remaining registrations.


SPIN = "rospy.spin()"
RATE = "r = rospy.Rate(0.01)\nwhile not rospy.is_shutdown(): r.sleep()"
SLEEP = "rospy.sleep(1000)"
WAIT_FOR_SERVICE = "rospy.wait_for_service('/nobody')"
WAIT_FOR_MESSAGE = "rospy.wait_for_message('/silent', String)"
CALLBACK_SLEEPS = """
rospy.Subscriber('self', String, lambda _: (print('in callback', flush=True), time.sleep(1000)))
pub = rospy.Publisher('self', String, queue_size=1, latch=True)
pub.publish('x')
rospy.spin()
"""
CALL_HANGS = """
rospy.Service('slow', Empty, lambda _: (print('in call', flush=True), time.sleep(1000)))
rospy.wait_for_service('slow')
try:
    rospy.ServiceProxy('slow', Empty)()
except rospy.ServiceException as error:
    assert isinstance(error, rospy.ROSInterruptException)  # genuine rospy raises one or the other
    raise rospy.ROSInterruptException(error)
"""

CALL_IS_ANSWERED = """
def answer_at_shutdown(_):
    print('in call', flush=True)
    rospy.sleep(1000)
    return []
rospy.Service('late', Empty, answer_at_shutdown)
rospy.wait_for_service('late')
rospy.ServiceProxy('late', Empty)()
"""

HEAD = """
import functools, threading, time
import rospy
from pipros.node.timings import NodeTimings
from rospy import node_start
from std_msgs.msg import String
from std_srvs.srv import Empty
patient = NodeTimings(unregister_s=30)  # the master, in the process of the test, may be busy
node_start.Node = functools.partial(node_start.Node, timings=patient)
rospy.init_node('node')
rospy.on_shutdown(lambda: print('hook', rospy.is_shutdown(), flush=True))
print('ready', flush=True)
"""

NAME_OPENSSL = "import asyncio, sys\nprint(sorted(sys.modules.keys() & {'_hashlib', '_ssl', 'ssl'}))\n"
USE_TLS = """
try:
    asyncio.run(asyncio.open_connection(host, port, ssl=True))
except Exception as error:  # the server speaks plain HTTP
    import ssl
    print(f"{type(error).__name__}: {isinstance(error, asyncio.sslproto.ssl.SSLError)}")
"""


Start = Callable[..., Process]


@pytest.fixture
def start(processes: Processes, master: Master) -> Start:
    """A function that starts a program on the master."""

    def start(body: str, head: str = HEAD, uri: str = master.uri, **more: str) -> Process:
        return processes.start(sys.executable, "-c", head + body, environment={"ROS_MASTER_URI": uri, **more})

    return start


def test_a_node_loads_openssl_with_its_first_use(start: Start, master: Master) -> None:
    address = f"host, port = '127.0.0.1', {master.uri.rpartition(':')[2].strip('/')}"
    code = NAME_OPENSSL + address + USE_TLS
    assert start(code).wait() == 0  # stores the compiled messages
    node = start(code)
    assert (node.wait(), node.lines[-3:]) == (0, ["[]", "SSLError: True", "hook False"])


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    ("body", "ready"), [(SPIN, "ready"), (RATE, "ready"), (SLEEP, "ready"), (CALLBACK_SLEEPS, "in callback")]
)
def test_a_signal_ends_a_node_cleanly(start, client, body: str, ready: str, number: int) -> None:
    node = start(body)
    node.wait_for(ready)
    node.send_signal(number, code=0)
    assert "hook False" in node.output
    assert "Traceback" not in node.output
    assert client.get_system_state() == [[], [], []]


@pytest.mark.parametrize("body", [SPIN, SLEEP])
def test_a_closed_terminal_ends_a_node_as_without_a_handler_but_after_its_hooks(start, client, body) -> None:
    node = start(body)
    node.wait_for("ready")
    node.send_signal(signal.SIGHUP, code=-signal.SIGHUP)
    assert client.get_system_state() == [[], [], []]


def test_a_running_call_may_end_after_a_signal(start: Start) -> None:
    head = HEAD.replace("unregister_s=30", "unregister_s=30, call_grace_s=30")
    node = start(CALL_IS_ANSWERED, head)
    node.wait_for("in call")
    node.send_signal(signal.SIGINT, code=0)
    assert "hook False" in node.output
    assert "Traceback" not in node.output


@pytest.mark.parametrize(
    ("body", "ready", "error"),
    [
        (WAIT_FOR_SERVICE, "ready", "ROSInterruptException: rospy shutdown"),
        (WAIT_FOR_MESSAGE, "ready", "ROSInterruptException: rospy shutdown"),
        (CALL_HANGS, "in call", "ROSInterruptException: node shutdown interrupted service call"),
    ],
)
def test_a_wait_interrupted_by_a_signal_raises_noetics_exception(start, body, ready: str, error: str) -> None:
    node = start(body)
    node.wait_for(ready)
    node.send_signal(signal.SIGINT)
    assert (node.wait(), error in node.output) == (INTERRUPTED, True), node.output


def test_shutdown_does_not_join_a_thread_that_was_not_started(start: Start) -> None:
    end = "rospy.core._add_shutdown_thread(threading.Thread(target=print))\nrospy.signal_shutdown('bye')\n"
    start(end + "print('over')").check(0, "over")


def test_shutdown_joins_running_threads_and_forgets_ended_ones(start: Start) -> None:
    node = start("""
over = threading.Event()
rospy.core.add_shutdown_hook(lambda _: over.set())
def at_the_end(): over.wait(), print('joined')
for target in (int, int, at_the_end):
    thread = threading.Thread(target=target, daemon=True)
    rospy.core._add_shutdown_thread(thread)
    thread.start()
    if target is int: thread.join()
print('kept', len(rospy.core._shutdown_threads))
rospy.signal_shutdown('bye')
print('over')
""")
    expected = ["kept 1", "joined", "over"]
    assert (node.wait(), [line for line in node.output.split("\n") if line in expected]) == (0, expected)


def test_hooks_are_called_without_a_node(start: Start) -> None:
    program = (
        "import rospy\nrospy.on_shutdown(lambda: print('client'))\n"
        "rospy.core.add_preshutdown_hook(print)\nrospy.core.add_shutdown_hook(lambda _: print('last'))\n"
        "rospy.signal_shutdown('reason')\nrospy.signal_shutdown('again')\n"
    )
    node = start(program, head="")
    assert (node.wait(), node.output.split()) == (0, ["client", "reason", "last"])


@pytest.mark.parametrize("init", ["", "rospy.init_node('node')\n"])
def test_hooks_may_exit_and_add_hooks_and_come_after_exit_handlers(start: Start, init: str) -> None:
    """Asked of genuine rospy."""
    head = "import atexit, sys, rospy\natexit.register(lambda: print('exit', rospy.is_shutdown()))\n" + init
    node = start(
        "rospy.on_shutdown(lambda: (rospy.on_shutdown(lambda: print('last')), sys.exit(5)))\n"
        "rospy.on_shutdown(lambda: print('next'))\n",
        head,
    )
    assert node.wait() == 0
    wanted = ["exit False", "next", "last"]
    assert [line for line in node.output.split("\n") if line in wanted] == wanted, node.output


def test_spin_of_a_service_ends_with_the_service(start: Start) -> None:
    body = "service = rospy.Service('a', Empty, print)\nthreading.Timer(0.1, service.shutdown).start()\n"
    node = start(body + "service.spin()\nprint('goes on', rospy.is_shutdown(), flush=True)\n")
    node.check(0, "goes on False")


def press_until_ended(node: Process) -> None:
    wait_until(lambda: not node.is_running or node.send_signal(signal.SIGINT), what="the end of the node")


def test_a_second_ctrl_c_ends_a_node_whose_hook_hangs(start: Start) -> None:
    hang = "rospy.on_shutdown(lambda: (print('hanging', flush=True), time.sleep(1000)))\n"
    node = start(hang + "print('hook is set', flush=True)\n" + SPIN)
    node.wait_for("hook is set")
    node.send_signal(signal.SIGINT)
    node.wait_for("hanging")

    press_until_ended(node)  # again, in case the second signal followed so quickly that it was the first
    assert node.wait() == 128 + signal.SIGINT


def test_another_ctrl_c_ends_a_program_that_survives_its_node(start: Start) -> None:
    body = """
import threading
threading.Timer(0, lambda: (rospy.spin(), print('over', flush=True))).start()
while True:
    time.sleep(0.1)
"""
    node = start(body)
    node.wait_for("ready")
    node.send_signal(signal.SIGINT)
    node.wait_for("over")
    press_until_ended(node)
    node.wait()
    assert "KeyboardInterrupt" in node.output


def test_a_node_waits_for_its_master_and_continues_when_it_starts(start, claimed_port: ClaimedPort) -> None:
    node = start(SPIN, uri=claimed_port.uri)
    node.wait_for("Will keep trying")
    with Master(port=claimed_port.number):
        node.wait_for("ready")
        node.send_signal(signal.SIGINT, code=0)


def test_a_script_that_returns_leaves_no_registrations(start: Start, client: MasterClient) -> None:
    node = start("rospy.Publisher('a', String, queue_size=1)")
    node.check(0, "hook False")
    assert client.get_system_state() == [[], [], []]


def test_disable_signals_leaves_them_alone(start: Start) -> None:
    # If text is executed after Ctrl-C, as by a thread that imports dataclasses, Python's exit code is 1.
    code = "import pipros.net.outgoing, pipros.node.shared_publication, pipros.node.subscriber\n"
    code += HEAD.replace("init_node('node')", "init_node('node', disable_signals=True)")
    node = start("time.sleep(1000)", code)
    node.wait_for("ready")
    node.send_signal(signal.SIGINT)
    assert (node.wait(), "KeyboardInterrupt" in node.output) == (-signal.SIGINT, True), node.output


def test_spin_ends_the_node_on_ctrl_c_if_signals_are_disabled(start: Start) -> None:
    code = HEAD.replace("init_node('node')", "init_node('node', disable_signals=True)")
    node = start("rospy.spin()\nprint('goes on', rospy.is_shutdown(), flush=True)", code)
    node.wait_for("ready")
    node.send_signal(signal.SIGINT)
    node.check(0, "hook False", "goes on True")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_handler_from_before_the_node_comes_after_its_hooks(start: Start, number: int) -> None:
    """Asked of genuine rospy: its handler shuts the node down, then calls the handler before it."""
    code = "import signal, sys\ndef land(number, frame):\n    print('land', flush=True)\n    sys.exit(3)\n"
    code += f"signal.signal({int(number)}, land)\n" + HEAD
    node = start("rospy.spin()", code)
    node.wait_for("ready")
    node.send_signal(number)
    assert node.wait() == 3
    assert node.output.index("hook False") < node.output.index("land"), node.output


def test_a_custom_signal_handler_is_respected(start: Start) -> None:
    body = """
import os, signal
def land(number, frame):  # may come while print() prints, which cannot be entered twice
    os.write(1, b'landing %r\\n' % rospy.is_shutdown())
    if landed: previous(number, frame)
    landed.append(True)
landed = []
previous = signal.signal(signal.SIGINT, land)
print('flies', flush=True)
rospy.spin()
"""
    node = start(body)
    node.wait_for("flies")
    node.send_signal(signal.SIGINT)
    node.wait_for("landing False")
    again = node.mark()
    node.send_signal(signal.SIGINT)
    node.wait_for("landing False", since=again)
    node.check(0, "hook False")


def test_a_signal_is_handled_while_another_library_owns_the_wakeup_descriptor(start: Start) -> None:
    body = """
import asyncio, signal
async def main():
    asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, print)
    print('in asyncio', flush=True)
    while not rospy.is_shutdown():
        await asyncio.sleep(0.01)
asyncio.run(main())
"""
    node = start(body)
    node.wait_for("in asyncio")
    node.send_signal(signal.SIGINT, code=0)
    assert "hook False" in node.output


@pytest.mark.skipif(not hasattr(os, "fork"), reason="children are not forked here")
def test_a_forked_child_ends_by_signals_and_takes_nothing_with_it(start: Start, client: MasterClient) -> None:
    body = """
import multiprocessing, os, sys
fork = multiprocessing.get_context('fork')
with fork.Pool(2) as pool:  # its end is a SIGTERM to each
    print(pool.map(abs, [-1]), flush=True)
if os.fork() == 0:
    sys.exit(0)
os.wait()
rospy.Publisher('a', String, queue_size=1)
print('still', rospy.is_shutdown(), flush=True)
rospy.spin()
"""
    node = start(body)
    node.wait_for("still False")
    assert "hook" not in node.output
    assert ["/a", ["/node"]] in client.get_system_state()[0]
    node.send_signal(signal.SIGINT, code=0)


def test_a_signal_to_a_child_at_its_start_does_not_end_the_node(start: Start) -> None:
    body = """
import os, signal
if os.fork() == 0:
    os._exit(9)
_, status = os.wait()
print('child', os.waitstatus_to_exitcode(status), flush=True)
try:
    rospy.wait_for_message('never', String, 0.5)
except rospy.ROSException as error:
    print(type(error).__name__, rospy.is_shutdown(), flush=True)
"""
    # Hooks that were registered first run first in the child.
    early = """
import os, signal
os.register_at_fork(after_in_child=lambda: os.kill(os.getpid(), signal.SIGTERM))
"""
    node = start(body, early + HEAD)
    node.wait_for(f"child {-signal.SIGTERM}")
    node.wait_for("ROSException False")
    assert node.wait() == 0


def test_a_node_logs_the_reason_of_a_requested_shutdown(start: Start, client: MasterClient) -> None:
    node = start(SPIN)
    node.wait_for("ready")
    api = client.lookup_node("/node")
    with RpcClient(api) as peer:
        assert peer.call("shutdown", "/rosnode", "user request") == [1, "shutdown", 0]
    assert node.wait() == 0
    assert "shutdown request: user request" in node.stdout


def test_simulated_time_follows_clock(start: Start, client: MasterClient) -> None:
    client.set_param("/use_sim_time", True)
    body = """
from rosgraph_msgs.msg import Clock
print('zero', rospy.Time.now().to_nsec(), flush=True)
clock = rospy.Publisher('/clock', Clock, queue_size=1)
def drive():
    for t in range(10, 10_000):
        clock.publish(rospy.Time(t)); time.sleep(0.01)
threading.Thread(target=drive, daemon=True).start()
rospy.sleep(20)
print('slept', rospy.get_time() >= 30, flush=True)
rospy.signal_shutdown('done')
"""
    node = start(body)
    assert node.wait() == 0
    assert "zero 0" in node.stdout
    assert "slept True" in node.stdout


def test_remappings_and_namespaces_from_the_command_line(processes, tmp_path, master, client) -> None:
    script = tmp_path / "node.py"
    script.write_text(
        HEAD + "rospy.Publisher('chat', String, queue_size=1)\nprint(rospy.get_param('~rate'), flush=True)\n"
        "rospy.spin()"
    )
    arguments = [
        "chat:=/talk", "_rate:=[1, 2]", "__name:=other", "__ns:=robot", f"__master:={master.uri}",
        "__log:=my.log",
    ]  # fmt: skip
    node = processes.start(sys.executable, script, *arguments, cwd=tmp_path)
    node.wait_for(r"\[1, 2\]")
    wait_until(lambda: ["/talk", ["/robot/other"]] in client.get_system_state()[0])
    assert (tmp_path / "my.log").exists()


@pytest.mark.parametrize("call", ["get_param", "get_param_cached", "delete_param"])
def test_a_missing_parameter_is_one_traceback(start: Start, call: str) -> None:
    node = start(f"rospy.{call}('~turtle')")
    assert node.wait() == 1
    text = "\n".join(node.lines)
    assert text.count("Traceback (most recent call last)") == 1
    assert "KeyError: '~turtle'" in text


# A process that starts a second node after the first has shut down, as notebooks and tests do.


AGAIN_HEAD = """
import functools, os, signal, sys
import rospy, rospy.client, rospy.core
from pipros.node.timings import NodeTimings
from rospy import node_start
from std_msgs.msg import String
from std_srvs.srv import Trigger
patient = NodeTimings(unregister_s=30)  # the master, in the process of the test, may be busy
node_start.Node = functools.partial(node_start.Node, timings=patient)

def begin_anew(name, **more):
    rospy.client._init_node_args = None
    rospy.core._shutdown_flag = rospy.core._in_shutdown = False
    rospy.init_node(name, **more)

def talk_to_oneself():
    publisher = rospy.Publisher('said', String, queue_size=1, latch=True)
    publisher.publish('by ' + rospy.get_name())
    print('heard', rospy.wait_for_message('said', String, 20).data)
    rospy.Service('~ask', Trigger, lambda _: (True, rospy.get_name()))
    print('answered', rospy.ServiceProxy('~ask', Trigger)().message)

def registered():
    state = rospy.get_master().getSystemState()[2]
    return sorted({node for part in state for _, nodes in part for node in nodes})
"""

FIRST = """
rospy.init_node('first')
rospy.on_shutdown(lambda: print('hook of the first'))
talk_to_oneself()
"""

SECOND = """
talk_to_oneself()
rospy.loginfo('said once')
print('registered', registered())
rospy.spin()
print('ended', registered())
"""


@pytest.fixture
def again(start: Start) -> Start:
    return functools.partial(start, head=AGAIN_HEAD, PYTHONUNBUFFERED="1")


@pytest.mark.parametrize(
    "between",
    [
        "rospy.signal_shutdown('enough')\nbegin_anew('second')",
        "rospy.signal_shutdown('enough')\nbegin_anew('second', disable_signals=True)",
        "os.kill(os.getpid(), signal.SIGINT)\nrospy.spin()\nbegin_anew('second')",
        "rospy.client._init_node_args = None\nrospy.init_node('second')",
    ],
)
def test_a_second_node_is_fully_functional(again: Start, between: str) -> None:
    node = again(FIRST + between + SECOND)
    node.wait_for("^registered")
    node.press_ctrl_c(code=0)
    assert [line for line in node.stdout if not line.startswith("[")] == [
        "heard by /first", "answered /first", "hook of the first", "heard by /second", "answered /second",
        "registered ['/second']", "ended []",
    ]  # fmt: skip
    assert len([line for line in node.stdout if "said once" in line]) == 1


@pytest.mark.parametrize(("argument", "level", "said"), [
    ("_rate:=[1", None, "ROSInitException invalid command-line parameters: "),
    ("a:=b:=c", None, "ROSInitException invalid command-line parameters: "),
    ("a", 10, "KeyError 'log_level must be rospy.DEBUG"),
])  # fmt: skip
def test_a_bad_argument_raises_noetics_exception_and_leaves_nothing(again, argument, level, said) -> None:
    node = again(
        f"try:\n    rospy.init_node('~first', argv=['_a:=1', '{argument}'], log_level={level})\n"
        "except Exception as error:\n    print(type(error).__name__, error)\n"
        "print(registered())\nrospy.init_node('~first')\nprint(rospy.get_name(), rospy.has_param('~a'))"
    )
    assert node.wait() == 0
    assert node.stdout[0].startswith(said)
    assert node.stdout[1:] == ["[]", "/unnamed/first False"]


def test_objects_of_the_first_node_are_refused_with_a_reason(again: Start) -> None:
    code = """
rospy.init_node('first')
publisher = rospy.Publisher('said', String, queue_size=1)
subscriber = rospy.Subscriber('said', String)
rospy.signal_shutdown('enough')
publisher.publish('not received')
begin_anew('second')
try:
    publisher.publish('x')
except rospy.ROSException as error:
    print(error)
publisher.unregister()
subscriber.unregister()
"""
    node = again(code)
    assert (node.wait(), node.stdout) == (0, ["publish() to a closed topic"]), node.output


def test_a_forked_child_may_start_its_own_node(again: Start) -> None:
    code = """
rospy.init_node('parent')
child = os.fork()
if not child:
    rospy.client._init_node_args = None
    rospy.init_node('child')
    talk_to_oneself()
    print('registered', registered())
    sys.exit()
assert os.waitpid(child, 0)[1] == 0
print('is shut down', rospy.is_shutdown())
print('registered', registered())
talk_to_oneself()
"""
    node = again(code)
    assert node.wait() == 0, node.output
    assert node.stdout == [
        "heard by /child", "answered /child", "registered ['/child', '/parent']", "is shut down False",
        "registered ['/parent']", "heard by /parent", "answered /parent",
    ]  # fmt: skip


def test_forked_children_and_their_parent_get_only_their_own_answers(again: Start) -> None:
    code = """
import multiprocessing
from std_srvs.srv import SetBool
rospy.init_node('parent')
rospy.Service('echo', SetBool, lambda request: (True, str(request.data)))
proxies = [rospy.ServiceProxy('echo', SetBool, persistent=kept) for kept in (False, True)]
def ask(number):
    for turn in range(50):
        rospy.set_param(f'turn_of/{number}', turn)
        yield rospy.get_param(f'turn_of/{number}') == turn
        yield from (proxy(turn % 2 == number).message == str(turn % 2 == number) for proxy in proxies)
def count(number):
    return sum(ask(number))
count(0)  # so that all connections are open
with multiprocessing.get_context('fork').Pool(2) as pool:
    children = pool.map_async(count, [1, 2])
    print(count(0), children.get(20))
"""
    node = again(code)
    assert (node.wait(), node.stdout) == (0, ["150 [150, 150]"]), node.output


def test_a_child_forked_while_a_thread_imports_may_use_topics(again: Start) -> None:
    code = """
import importlib.util, threading, time
from pipros.node import node

class SlowImport:
    def find_spec(self, name, path, target=None):
        if name == 'pipros.node.publisher_connector':
            sys.meta_path.remove(self)
            spec = importlib.util.find_spec(name)
            run = spec.loader.exec_module
            spec.loader.exec_module = lambda module: (begun.set(), time.sleep(0.5), run(module))
            return spec

begun = threading.Event()
sys.meta_path.insert(0, SlowImport())
node._LOAD_LINKS_S = 1.0  # so that `init_node` has returned
rospy.init_node('parent')
assert begun.wait(10)
child = os.fork()
if not child:
    from pipros.node.subscriber import Subscriber
    os._exit(0)
assert os.waitpid(child, 0)[1] == 0
"""
    node = again(code)
    assert node.wait() == 0, node.output


def test_a_flag_that_a_program_sets_ends_its_loops(again: Start) -> None:
    code = """
rospy.init_node('first')
rospy.core._shutdown_flag = True
while not rospy.is_shutdown():
    pass
rospy.core._shutdown_flag = False
print(rospy.is_shutdown(), rospy.get_name())
talk_to_oneself()
"""
    node = again(code)
    assert (node.wait(), node.stdout) == (0, ["False /first", "heard by /first", "answered /first"])


def test_ctrl_c_ends_a_second_node_made_in_another_thread(again: Start) -> None:
    code = """
import threading
rospy.init_node('first')
rospy.signal_shutdown('enough')
thread = threading.Thread(target=begin_anew, args=('second',), kwargs={'disable_signals': True})
thread.start()
thread.join()
print('up')
rospy.spin()
print('ended', registered())
"""
    node = again(code)
    node.wait_for("^up$")
    node.send_signal(signal.SIGINT, code=0)
    assert node.stdout[-1] == "ended []"
