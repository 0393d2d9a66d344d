"""The tools of pipros in a genuine system, genuine tools in a pipros system, and both on the same nodes."""

import re
from typing import Any
from xmlrpc.client import ServerProxy

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.processes import Process
from tests.support.ros import RosSystem, Side
from tests.support.waiting import wait_until

COMMANDS = (
    "rostopic list", "rostopic list -v", "rostopic list -p", "rostopic list -s", "rostopic list --host",
    "rostopic list /point", "rostopic info /point", "rostopic type /point",
    "rostopic type /point/header/stamp", "rostopic find geometry_msgs/PointStamped", "rosnode list",
    "rosnode list -a", "rosnode info -q /genuine_talker", "rosnode info -q /pipros_talker", "rosnode machine",
    "rosparam list", "rosparam get /rosdistro", "rosparam get /", "rosparam dump",
    "rostopic echo -n 1 /point/point", "rostopic echo -n 1 /point/header/frame_id",
    "rostopic echo -n 1 --noarr -w 6 /point/point", "rostopic echo -n 1 -p /point/header/frame_id",
)  # fmt: skip


@pytest.fixture(params=["genuine master", "pipros master"])
def master(request: pytest.FixtureRequest, ros: RosSystem) -> Process:
    side = ros.genuine if request.param == "genuine master" else ros.pipros
    return side.start_bare_master()


KINDS = ("genuine", "pipros")


def test_tools_of_both_show_measure_and_kill_talkers_of_both(ros: RosSystem, master: Process) -> None:
    """All comparisons use one system, because starting it takes longer than most of them."""
    talkers = {kind: start_talker(ros, kind) for kind in KINDS}
    both_print_the_same(ros)
    both_describe_nodes_and_their_connections_alike(ros)
    the_rate_is_measured(ros)
    for killers in ((ros.genuine, ros.pipros), (ros.pipros, ros.genuine)):
        for kind, killer in zip(KINDS, killers, strict=True):
            pinged_and_killed(killer, f"/{kind}_talker", talkers[kind])
        if killers[0] is ros.genuine:
            talkers = {kind: start_talker(ros, kind) for kind in KINDS}


def start_talker(ros: RosSystem, kind: str) -> Process:
    side = ros.genuine if kind == "genuine" else ros.pipros
    process = side.start(
        *("rostopic", "pub", "-r", "20", "/point", "geometry_msgs/PointStamped"),
        *("{header: {stamp: now, frame_id: map}, point: {x: 1.5}}", f"__name:={kind}_talker"),
    )
    wait_until(lambda: f"/{kind}_talker" in ros.publishers("/point"), 30, f"the {kind} talker")
    return process


def both(ros: RosSystem, *argv: str) -> tuple[Process, Process]:
    """Run the same command of both implementations."""
    return ros.genuine.run(*argv), ros.pipros.run(*argv)


def both_print_the_same(ros: RosSystem) -> None:
    different = {}
    for command in COMMANDS:
        genuine, pipros = both(ros, *command.split())
        expected = genuine.returncode, _timeless(genuine.stdout)
        if (pipros.returncode, _timeless(pipros.stdout)) != expected or genuine.returncode != 0:
            different[command] = (genuine.output, pipros.output)
    assert different == {}


def _timeless(lines: list[str]) -> list[str]:
    return [re.sub(r"^\d{19},", "NOW,", line) for line in lines]


def both_describe_nodes_and_their_connections_alike(ros: RosSystem) -> None:
    listener = ros.genuine.start("rostopic", "echo", "/point", "__name:=listener")
    listener.wait_for("frame_id")
    # Nodes of earlier commands may still be listed as connected, and the second talker not yet.
    for node, count in (("/genuine_talker", 1), ("/pipros_talker", 1), ("/listener", 2)):
        wait_until(lambda: len(links_of(ros, node)) == count, 60, f"{count} links of {node}")  # noqa: B023
    for node in ("/genuine_talker", "/pipros_talker", "/listener"):
        genuine, pipros = both(ros, "rosnode", "info", node)
        assert pipros.stdout == genuine.stdout
        assert any(line.startswith(" * topic: /point") for line in pipros.stdout)
    listener.press_ctrl_c()
    assert listener.wait() == 0


def links_of(ros: RosSystem, node: str) -> list[Any]:
    """Return the links that a node reports."""
    with ServerProxy(ros.master_uri) as master:
        found: Any = master.lookupNode("/test", node)
    with ServerProxy(found[2]) as slave:
        described: Any = slave.getBusInfo("/test")
    return list(described[2])


def the_rate_is_measured(ros: RosSystem) -> None:
    hz = ros.pipros.start("rostopic", "hz", "/point")

    def has_both_talkers() -> bool:
        rates = re.findall(r"average rate: ([\d.]+)", hz.output)
        return any(20 < float(rate) < 80 for rate in rates)  # 40 Hz, but a stall counts until it averages out

    wait_until(has_both_talkers, 60, lambda: hz.output)
    hz.press_ctrl_c()
    assert hz.wait() == 0


def pinged_and_killed(side: Side, name: str, talker: Process) -> None:
    # A talker that is stalled for more than three seconds misses a ping.
    wait_until(lambda: "xmlrpc reply from" in side.run("rosnode", "ping", "-c", "1", name).output, 60, name)
    kill = side.run("rosnode", "kill", name)
    assert kill.stdout == [f"killing {name}", "killed"]
    assert talker.wait() == 0


def test_parameters_go_both_ways(ros: RosSystem, master: Process) -> None:
    values = "{list: [1, 2.5, true, text], nested: {deep: {x: -1}}, text: 'two\n\n  lines', empty: ''}"
    assert ros.pipros.run("rosparam", "set", "/from_pipros", values).returncode == 0
    assert ros.genuine.run("rosparam", "set", "/from_genuine", values).returncode == 0
    for key in ("/from_pipros", "/from_genuine"):
        genuine, pipros = both(ros, "rosparam", "get", key)
        assert pipros.stdout == genuine.stdout
    contents = [ros.pipros.run("rosparam", "get", key).stdout for key in ("/from_pipros", "/from_genuine")]
    assert contents[0] == contents[1]


def test_services_are_called_across(ros: RosSystem, master: Process) -> None:
    server = ros.genuine.start(
        "/usr/bin/python3",
        "-c",
        "import rospy, std_srvs.srv as s; rospy.init_node('server');"
        "rospy.Service('/set', s.SetBool, lambda r: (r.data, 'got it'));"
        "print('up', flush=True); rospy.spin()",
    )
    server.wait_for("up")
    for command in ("type", "node", "info", "args", "uri"):
        genuine, pipros = both(ros, "rosservice", command, "/set")
        assert (pipros.returncode, pipros.stdout) == (genuine.returncode, genuine.stdout)
    genuine, pipros = both(ros, "rosservice", "call", "/set", "true")
    assert pipros.stdout == genuine.stdout == ["success: True", 'message: "got it"']


def test_both_end_with_the_same_code_and_keep_the_order_of_the_master(ros, master: Process) -> None:
    server = ros.genuine.start(
        "/usr/bin/python3",
        "-c",
        "import rospy, std_srvs.srv as s; rospy.init_node('server');"
        "[rospy.Service(name, s.SetBool, lambda r: (r.data, '')) for name in ('/z', '/a')];"
        "print('up', flush=True); rospy.spin()",
    )
    server.wait_for("up")
    for topic in ("/z_text", "/a_text"):
        ros.pipros.start("rostopic", "pub", topic, "std_msgs/String", "x")
        ros.wait_for_publisher(topic)
    different = {}
    for command in (
        "rosmsg --help", "rossrv --help", "rosnode --help", "rosnode -h", "rostopic find std_msgs/String",
        "rosservice find std_srvs/SetBool", "rosservice list", "rosservice call /z 7", "rosservice call /z {",
    ):  # fmt: skip
        genuine, pipros = both(ros, *command.split())
        if (pipros.returncode, pipros.stdout) != (genuine.returncode, genuine.stdout):
            different[command] = (genuine.output, pipros.output)
    assert different == {}
    hz = ros.pipros.start("rostopic", "hz", "/nothing")
    hz.wait_for("does not appear to be published yet")
    hz.press_ctrl_c()
    assert hz.wait() == 1


def test_the_documents_of_a_file_are_published_alike(ros: RosSystem) -> None:
    words: list[str] = []
    (ros.home / "one").write_text("data: one\n")
    (ros.home / "two").write_text("data: first\n---\ndata: second\n")
    ros.serve_master()
    reader = Node("reader", environment=Environment(master_uri=ros.master_uri))
    reader.start()
    reader.subscribe("/words", load_message_class("std_msgs/String"), lambda word: words.append(word.data))
    for options in ("-f two -v -r 20", "-f two", "-1 -f two -v", "-1 -f one", "-l -r 20 -f two"):
        genuine, ours = both(ros, "rostopic", "pub", *options.split(), "/words", "std_msgs/String")
        assert (options, ours.returncode, ours.stdout) == (options, genuine.returncode, genuine.stdout)
    for options, first, last in (
        ("-f one -v", "Got one message and a rate, publishing repeatedly", 'publishing data: "one"'),
        ("-l -f two", "publishing and latching message. Press ctrl-C to terminate", "latching"),
    ):
        for side in (ros.genuine, ros.pipros):
            before = len(words)
            command = side.start("rostopic", "pub", *options.split(), "/words", "std_msgs/String")
            command.wait_for(re.escape(last), 60.0)
            # Ctrl-C comes after a message: while it publishes, genuine may fail, or wait for a lock forever.
            if options == "-f one -v":
                before = len(words)
            wait_until(lambda: len(words) > before, 60, "a message")  # noqa: B023
            command.press_ctrl_c()
            assert (command.wait(), command.stdout[0]) == (0, first)
    wait_until(lambda: words.count("second") == 6, 60, what="both documents of six files")
    reader.shutdown("end of the test")


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("rosmsg package", "std_msgs"), ("rossrv package", "std_srvs"), ("rosmsg md5", "std_msgs/String"),
        ("rossrv md5", "std_srvs/Empty"), ("rosmsg show", "std_msgs/Header"),
    ],
)  # fmt: skip
def test_a_name_may_come_from_a_pipe(ros: RosSystem, command: str, name: str) -> None:
    genuine, ours = (side.run("sh", "-c", f"echo {name} | {command}") for side in (ros.genuine, ros.pipros))
    assert (ours.returncode, sorted(ours.stdout)) == (genuine.returncode, sorted(genuine.stdout))
    assert ours.stdout
