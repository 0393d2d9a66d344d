"""Nodelets in Python: managers, loaders, bonds, names, and messages within one process."""

import signal
import threading
from typing import Any

import pytest
from sensor_msgs.msg import Image
from std_msgs.msg import String

from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros.node.hosted_node import HostedNode
from pipros.node.service_link import ServiceFailed
from pipros_libraries.nodelets.as_node import run_alone
from pipros_libraries.nodelets.hosting import CannotLoad, Hosting
from tests.support.constants import Constants
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PLUGINS = """
from pipros.msg import load_message_class

String = load_message_class("std_msgs/String")

class Relay:
    def __init__(self, node):
        self.node = node
        self.suffix = str(node.params.get("~suffix"))
        self.output = node.advertise("~out", String, queue_size=10)
        node.subscribe("in", String, self.relay, queue_size=10)
        node.log.info("words %s", node.arguments)

    def relay(self, message):
        self.output.publish(String(f"{message.data} {self.suffix}"))

    def close(self):
        self.node.log.info("closed %s", self.node.name)

class Broken:
    def __init__(self, node):
        node.advertise("never", String)
        raise ValueError("no luck")
"""

LAUNCH = """<launch>
  <node name="mgr" pkg="nodelet" type="nodelet" args="manager" output="screen"/>
  <group ns="robot">
    <node name="one" pkg="nodelet" type="nodelet" args="load demo/Relay /mgr a b" output="screen">
      <param name="suffix" value="1"/><remap from="in" to="/words"/>
    </node>
    <node name="two" pkg="nodelet" type="nodelet" args="load demo/Relay /mgr" output="screen">
      <param name="suffix" value="2"/><remap from="in" to="one/out"/>
    </node>
  </group>
</launch>
"""


@pytest.fixture
def demo(ros: RosSystem) -> RosSystem:
    """A system with a package that offers nodelets by entry points."""
    folder = ros.home / "site" / "demo-1.0.dist-info"
    folder.mkdir(parents=True)
    (folder.parent / "demo_nodelets.py").write_text(PLUGINS)
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: demo\nVersion: 1.0\n")
    (folder / "entry_points.txt").write_text(
        "[pipros.nodelets]\ndemo/Relay = demo_nodelets:Relay\ndemo/Broken = demo_nodelets:Broken\n"
    )
    ros.pipros.environment["PYTHONPATH"] = str(folder.parent)
    return ros


def test_a_launch_file_loads_nodelets_that_share_a_process(demo: RosSystem) -> None:
    (demo.home / "chain.launch").write_text(LAUNCH)
    launch = demo.pipros.start("roslaunch", "-p", str(demo.port), "chain.launch")
    launch.wait_for(r"nodelet /robot/two \(demo/Relay\) runs in Python")
    launch.wait_for(r"words \('a', 'b'\)")
    inbox = Inbox()
    listing, words = load_service_class("nodelet/NodeletList"), load_service_class("std_srvs/Trigger")
    with demo.node("robot") as node:
        listed = node.client("/mgr/list", listing)
        demo.wait_for_publisher("/robot/two/out")
        assert listed.call(listing._request_class()).nodelets == ["/robot/one", "/robot/two"]
        assert demo.publishers("/robot/two/out") == ["/mgr"]
        node.subscribe("/robot/two/out", String, inbox)
        source = node.advertise("/words", String)
        wait_until_connected(source)

        def send() -> bool:
            source.publish(String("hello"))
            return bool(inbox.messages)

        wait_until(send)
        assert inbox.messages[0].data == "hello 1 2"
        inputs = node.client("/mgr/inputs", words).call(words._request_class()).message.splitlines()
        assert inputs[0].startswith("/robot/one (demo/Relay): /words ")
        assert inputs[1].startswith("/robot/two (demo/Relay): /robot/one/out ")
        doctor = demo.pipros.run("pipros", "doctor").output
        assert "Nodelets in Python:" in doctor
        assert "  /robot/two (demo/Relay): /robot/one/out " in doctor
        info = demo.pipros.run("rosnode", "info", "/mgr").stdout
        assert "    * transport: INTRAPROCESS" in info

        demo.pipros.run("rosrun", "nodelet", "nodelet", "unload", "/robot/one", "mgr")
        launch.wait_for("closed /robot/one")
        launch.wait_for(r"\[robot/one-\d+\] process has finished cleanly")
        assert listed.call(listing._request_class()).nodelets == ["/robot/two"]
        assert not demo.publishers("/robot/one/out")
    launch.press_ctrl_c()
    launch.wait()
    assert "closed /robot/two" in launch.output


def test_the_end_of_a_loader_unloads_its_nodelet(demo: RosSystem) -> None:
    demo.serve_master()
    manager = demo.pipros.start("rosrun", "nodelet", "nodelet", "manager", "__name:=mgr")
    load = ("rosrun", "nodelet", "nodelet", "load", "demo/Relay", "mgr", "_suffix:=1")
    polite = demo.pipros.start(*load, "__name:=polite")
    killed = demo.pipros.start(*load, "__name:=killed")
    manager.wait_for("nodelet /polite")
    manager.wait_for("nodelet /killed")
    polite.press_ctrl_c(code=0)
    manager.wait_for("closed /polite")
    demo.wait_for_subscriber("/mgr/bond")
    killed.send_signal(signal.SIGKILL)
    manager.wait_for("unloading nodelet /killed, because its bond is broken", timeout_s=60)
    manager.wait_for("closed /killed")


def test_loaders_end_with_their_manager(demo: RosSystem) -> None:
    demo.serve_master()
    manager = demo.pipros.start("rosrun", "nodelet", "nodelet", "manager", "__name:=mgr")
    load = ("rosrun", "nodelet", "nodelet", "load", "demo/Relay", "mgr", "_suffix:=1")
    loader = demo.pipros.start(*load)
    manager.wait_for("nodelet /demo_Relay")
    demo.wait_for_subscriber("/mgr/bond")
    wait_until(lambda: len(demo.subscribers("/mgr/bond")) == 2)
    loader.wait_for("Loading nodelet /demo_Relay")
    with demo.node("witness") as node:
        inbox = Inbox.of(node, "/mgr/bond", load_message_class("bond/Status"))
        wait_until(lambda: len({each.instance_id for each in inbox.messages}) == 2)  # the bond is formed
    manager.press_ctrl_c(code=0)
    loader.wait_for("Bond broken, exiting")
    assert loader.wait() == 0


def test_nodelets_that_cannot_be_loaded_are_reported(demo: RosSystem) -> None:
    demo.serve_master()
    manager = demo.pipros.start("rosrun", "nodelet", "nodelet", "manager", "__name:=mgr")
    for plugin, reason in (
        ("demo/Broken", "demo/Broken failed to start: no luck"),
        ("demo/Nothing", "The nodelet demo/Nothing is a "),
    ):
        ended = demo.pipros.run("rosrun", "nodelet", "nodelet", "load", plugin, "mgr")
        assert ended.returncode == 255
        manager.wait_for(reason)
        alone = demo.pipros.run("rosrun", "nodelet", "nodelet", "standalone", plugin, PIPROS_NODELETS="ours")
        alone.check(255, reason)
    assert demo.publishers("/never") == []
    unknown = demo.pipros.run("rosrun", "nodelet", "nodelet", "unload", "/nothing", "mgr")
    assert unknown.returncode == 255
    usage = demo.pipros.run("rosrun", "nodelet", "nodelet", "load", "demo/Relay")
    usage.check(255, "nodelet usage:")
    wrong = demo.pipros.run("rosrun", "nodelet", "nodelet", "manager", PIPROS_NODELETS="both")
    assert "PIPROS_NODELETS must be ours or genuine, got [both]" in wrong.output


@pytest.fixture
def host(ros: RosSystem) -> Any:
    ros.serve_master()
    with ros.node("host") as node:
        yield node


@pytest.mark.parametrize(
    ("name", "remappings"),
    [("a b", {}), ("1x", {}), ("/r/ä", {}), ("/d", {"/a b": "/c"}), ("/d", {"/a": "/b c"})],
)
def test_nodelets_with_illegal_names_are_refused(host: Node, name: str, remappings: dict[str, str]) -> None:
    hosting = Hosting(host)
    with pytest.raises(CannotLoad, match="is not a legal name"):
        hosting.load(name, "image_proc/debayer", remappings=remappings)
    assert hosting.names() == []


def test_nodelets_that_any_node_can_load_are_limited(host: Node, constants: Constants) -> None:
    constants(NODELETS=1)
    hosting = Hosting(host)
    hosting.load("/one", "image_proc/debayer")
    with pytest.raises(CannotLoad, match="the limit is 1 nodelets"):
        hosting.load("/two", "image_proc/debayer")
    hosting.unload("/one")
    hosting.load("/two", "image_proc/debayer")


def test_ctrl_c_while_a_nodelet_starts_ends_with_0(host: Node, monkeypatch: pytest.MonkeyPatch) -> None:
    def load(*_: Any, **__: Any) -> None:
        host.shutdown("Ctrl-C")
        raise CannotLoad("a call was interrupted")

    monkeypatch.setattr(Hosting, "load", load)
    assert run_alone(host, host.log, "demo/Relay") == 0


def test_hosted_nodes_hand_messages_over_as_objects(host: Node) -> None:
    one, two = HostedNode(host, "/a/one"), HostedNode(host, "/b/two", remappings={"/b/in": "/a/one/out"})
    early, late, plain = Inbox(), Inbox(), Inbox()
    two.subscribe("in", Image, early, zero_copy=True)
    output = one.advertise("~out", Image, latch=True)
    assert (output.topic, output.connection_count) == ("/a/one/out", 1)
    sent = Image(width=3, data=b"abc")
    output.publish(sent)
    (got,) = early.wait()
    assert got.data.tolist() == [97, 98, 99]
    assert not got.data.flags.writeable
    two.subscribe("in", Image, plain)
    assert plain.wait()[0].data == b"abc"
    assert plain.messages[0] is sent
    two.shutdown()
    assert output.connection_count == 0
    three = HostedNode(host, "/c/three")
    three.subscribe("/a/one/out", Image, late)
    assert late.wait()[0] is sent


def test_hosted_nodes_call_services_until_they_end(host: Node) -> None:
    empty = load_service_class("std_srvs/Empty")
    begun, hangs, errors = threading.Event(), threading.Event(), []

    def handle(_: Any) -> Any:
        begun.set()
        hangs.wait()
        return empty._response_class()

    one, two = HostedNode(host, "/one"), HostedNode(host, "/two")
    one.serve("answer", empty, lambda _: empty._response_class())
    one.serve("hang", empty, handle)
    assert two.client("answer", empty).call(empty._request_class()) == empty._response_class()

    def call() -> None:
        try:
            two.client("hang", empty).call(empty._request_class())
        except ServiceFailed as error:
            errors.append(error)

    caller = threading.Thread(target=call)
    caller.start()
    assert begun.wait(60)
    two.shutdown()
    caller.join()
    hangs.set()
    assert len(errors) == 1


def test_a_slow_nodelet_gets_the_newest_messages(host: Node) -> None:
    one, two = HostedNode(host, "/one"), HostedNode(host, "/two")
    got: list[str] = []
    output = one.advertise("/words", String)

    def slow(message: Any) -> None:
        if not got:
            got.append(message.data)
            wait_until(lambda: subscriber.statistics()["dropped"] == 7)
        else:
            got.append(message.data)

    subscriber = two.subscribe("/words", String, slow, queue_size=2)
    output.publish(String("0"))
    wait_until(lambda: bool(got))
    for number in range(1, 10):
        output.publish(String(str(number)))
    wait_until(lambda: len(got) == 3)
    assert got == ["0", "8", "9"]


def test_hosted_nodes_and_other_nodes_share_topics(host: Node, ros: RosSystem) -> None:
    one, inside, outside = HostedNode(host, "/one"), Inbox(), Inbox()
    one.subscribe("/words", String, inside)
    output = one.advertise("/words", String)
    with ros.node("other") as other:
        other.subscribe("/words", String, outside)
        own = other.advertise("/words", String)
        wait_until_connected(output, 2)
        wait_until_connected(own, 2)
        output.publish(String("from inside"))
        outside.wait(1)
        own.publish(String("from outside"))
        inside.wait(2)
    assert sorted(each.data for each in inside.messages) == ["from inside", "from outside"]
