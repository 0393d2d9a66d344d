"""pipros doctor on running systems: planted faults, the steps of a message, and nothing in a healthy one."""

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest
from geometry_msgs.msg import PoseStamped, TransformStamped
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Header, Int32, String
from std_srvs.srv import Empty, EmptyResponse
from tf2_msgs.msg import TFMessage

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg.time import Time
from pipros.net.master_client import MasterClient
from pipros_tools.cli import doctor
from pipros_tools.health.examine import Examination, examine
from pipros_tools.health.gather_machine import gather_machine
from pipros_tools.health.gather_topic import gather_topic
from pipros_tools.health.machine_checks import check_machine
from pipros_tools.health.reach_back import reach_back
from pipros_tools.health.topic_check import STEPS, check_topic
from pipros_tools.health.topic_facts import TopicCheck
from tests.support.nodes import MakeNode, wait_until_connected
from tests.support.slaves import Served, SilentSlave
from tests.support.waiting import wait_until

# `pipros doctor` on running systems: it finds each planted fault, and nothing in a healthy system.


NOBODY = "http://127.0.0.1:1/"


@pytest.fixture(autouse=True)
def no_other_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    """A healthy machine: variables in the terminal of the tests are ignored."""
    here = ("ROS_HOSTNAME", "ROS_IP", "ROS_PACKAGE_PATH", "CMAKE_PREFIX_PATH", "PYTHONPATH", "ROS_VERSION")
    for name in here:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("pipros_tools.health.gather_machine.COMMANDS", ())


@pytest.fixture
def master(master: Master, monkeypatch: pytest.MonkeyPatch) -> Master:
    monkeypatch.setenv("ROS_MASTER_URI", master.uri)
    return master


def fake_node(**values: Any) -> Served:
    """Serve the slave API of a node, from a table of responses."""
    table = {"getPid": 1, "getBusInfo": [], **values}
    return Served({name: lambda *_, value=value: [1, "", value] for name, value in table.items()})


@contextmanager
def repeating(publish: Callable[[], object], period_s: float = 0.02) -> Iterator[None]:
    has_ended = threading.Event()

    def repeat() -> None:
        while not has_ended.wait(period_s):
            publish()

    thread = threading.Thread(target=repeat, daemon=True)
    thread.start()
    yield
    has_ended.set()
    thread.join()


def pose(stamp: Time, frame: str = "map") -> Any:
    message = PoseStamped()
    message.header.stamp, message.header.frame_id = stamp, frame
    return message


@pytest.fixture
def talker_and_listener(master: Master, make_node: MakeNode) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = talker.advertise("/chatter", String)
    subscriber = listener.subscribe("/chatter", String, lambda _: None)
    wait_until(lambda: publisher.connection_count == 1 and subscriber.connection_count == 1)


@pytest.fixture
def sick_system(master: Master, make_node: MakeNode, talker_and_listener: None) -> Iterator[None]:
    """A healthy talker and listener, and a dozen faults around them, all found without waiting in vain."""
    sick = make_node("sick")

    def publish(node: str, topic: str, type_name: str, api: str) -> None:
        register_as(master, node, "registerPublisher", topic, type_name, api)

    publish("/ghost", "/a", "std_msgs/String", NOBODY)
    publish("/stranger", "/b", "std_msgs/String", "http://no.such.host.invalid:9/")
    publish("/left_over", "/d", "std_msgs/String", sick.uri)
    publish("/exotic", "/e", "no_such_package/Thing", sick.uri)
    sick.subscribe("/chatter", Int32, lambda _: None)
    other_string: Any = type("String", (String,), {"_md5sum": "0" * 32})
    make_node("outdated").subscribe("/chatter", other_string, lambda _: None)
    sick.subscribe("/chater", String, lambda _: None)
    register_as(master, "/sick", "registerService", "/broken", "rosrpc://127.0.0.1:1", sick.uri)
    for name in ("clock1", "clock2"):
        make_node(name).advertise("/clock", Clock)
    poses = sick.advertise("/pose", PoseStamped)
    other = fake_node(getMasterUri="http://127.0.0.1:2/")
    publish("/elsewhere", "/f", "std_msgs/String", other.api)
    deaf = fake_node(getBusInfo=[[1, sick.uri, "i", "TCPROS", "/pose", True]])
    register_as(master, "/deaf", "registerSubscriber", "/pose", "geometry_msgs/PoseStamped", deaf.api)
    with repeating(lambda: poses.publish(pose(Time(1_000_000_000))), 0.05):
        yield
    for fake in (other, deaf):
        fake.stop()


def register_as(master: Master, node: str, method: str, *params: str) -> None:
    client = MasterClient(master.uri, node)
    client.call(method, *params)
    client.close()


def examined(master: Master, *, timeout_s: float = 30.0, **options: Any) -> Examination:
    return examine(Environment(master_uri=master.uri), timeout_s=timeout_s, **options)


def test_the_given_environment_decides_on_the_master(master: Master, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", NOBODY)
    monkeypatch.setenv("ROS_IP", "192.0.2.1")
    found = examined(master)
    assert found.system is not None
    assert "192.0.2.1" not in str(found.findings)
    assert examine(timeout_s=30.0).system is None


def test_nothing_is_found_in_a_healthy_system(master: Master, talker_and_listener: None) -> None:
    examination = examined(master)
    assert (examination.findings, examination.is_healthy) == ((), True)
    assert len(examination.system.pairs()) == 1
    both_ways = examined(master, both_ways=True)
    assert (both_ways.findings, both_ways.system.reached_back) == ((), {("/chatter", "/listener")})


def test_old_latched_messages_and_types_of_ended_topics_are_fine(master: Master, make_node: MakeNode) -> None:
    node = make_node("camera")
    node.advertise("/pose", PoseStamped, latch=True).publish(pose(Time(1_000_000_000)))
    register_as(master, "/camera", "registerPublisher", "/old", "no_such_package/Thing", node.uri)
    register_as(master, "/camera", "unregisterPublisher", "/old", node.uri)
    assert examined(master).findings == ()


def test_each_planted_fault_is_found(master: Master, sick_system: None) -> None:
    found = {(finding.rule, *finding.subjects) for finding in examined(master).findings}
    assert found >= {
        ("ghost-node", "/ghost"), ("unknown-host", "/stranger"), ("no-publisher", "/d", "/left_over"),
        ("unknown-type", "no_such_package/Thing", "/e"), ("type-mismatch", "/chatter", "/talker", "/sick"),
        ("md5-mismatch", "/chatter", "/talker", "/outdated"), ("no-publishers", "/chater", "/sick"),
        ("service-failed", "/broken", "/sick"), ("two-clocks", "/clock", "/clock1", "/clock2"),
        ("clock-unused", "/clock"), ("stamps-differ", "/pose", "/sick"), ("other-master", "/elsewhere"),
        ("one-sided-connection", "/pose", "/sick", "/deaf"),
    }  # fmt: skip
    assert not any("/listener" in finding for finding in found), "which is well"


def test_a_silent_node_is_found(master: Master) -> None:
    silent = SilentSlave()
    register_as(master, "/silent", "registerPublisher", "/c", "std_msgs/String", silent.api)
    found = {(finding.rule, *finding.subjects) for finding in examined(master, timeout_s=1.0).findings}
    assert ("silent-node", "/silent") in found
    silent.stop()


def test_a_subscriber_that_cannot_reach_this_machine_does_not_connect(master: Master) -> None:
    register_as(master, "/far", "registerSubscriber", "/x", "std_msgs/String", NOBODY)
    pairs = {("/x", "/far")}
    assert reach_back(pairs, Environment(master_uri=master.uri), wait_s=0.1) == frozenset()


def test_json_has_the_findings_and_the_exit_code_says_that_there_are_errors(master: Master, capsys) -> None:
    register_as(master, "/ghost", "registerPublisher", "/a", "std_msgs/String", NOBODY)
    assert doctor.main(["--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert (report["ok"], report["examined"]["nodes"]) == (False, ["/ghost"])
    (finding,) = report["findings"]
    assert (finding["rule"], finding["severity"], finding["subjects"]) == ("ghost-node", "error", ["/ghost"])
    assert "rosnode cleanup" in finding["cure"]


def test_findings_are_printed_with_advice(master: Master, capsys: pytest.CaptureFixture[str]) -> None:
    register_as(master, "/ghost", "registerPublisher", "/a", "std_msgs/String", NOBODY)
    assert doctor.main([]) == 1
    output = capsys.readouterr().out
    assert output.startswith("ERROR Node [/ghost] is registered, but does not answer")
    assert "\n  What to do: The node has exited without unregistering" in output
    assert "Found 1 error. Examined: " in output


def test_without_a_master_it_says_how_to_start_one(monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    assert doctor.main(["--offline"]) == 0
    assert "Nothing is wrong. Examined: the setup of this machine." in capsys.readouterr().out
    assert doctor.main([]) == 1
    assert "Start it: roscore -p 1" in capsys.readouterr().out


@pytest.mark.needs("/proc")
@pytest.mark.parametrize("ip", ["127.0.0.2", ""])
def test_a_master_that_does_not_listen_at_localhost_is_found(ip: str, monkeypatch, capsys) -> None:
    with Master(host="127.0.0.2", port=0) as master:
        monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{master.port}")
        monkeypatch.setenv("ROS_IP", ip)
        assert doctor.main([]) == 1
        output = capsys.readouterr().out
        assert f"but one answers at http://127.0.0.2:{master.port}." in output
        assert f"export ROS_MASTER_URI=http://127.0.0.2:{master.port} in each terminal" in output


def test_the_self_test_passes(capsys: pytest.CaptureFixture[str]) -> None:
    assert doctor.main(["--self-test", "--json"]) == 0
    outcome = json.loads(capsys.readouterr().out)
    assert outcome["findings"] == []
    assert outcome["heard"] >= 1


@pytest.mark.parametrize(
    "line", ["--timeout 0", "--timeout nan", "--nonsense", "--wait 0 /chatter", "--wait nan /chatter"]
)
def test_invalid_arguments_exit_with_2_and_are_named(line: str, capsys) -> None:
    with pytest.raises(SystemExit) as end:
        doctor.main(line.split())
    assert (end.value.code, line.split()[0] in capsys.readouterr().err) == (2, True)


def test_faults_of_a_setup_are_reported(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    genuine, home = tmp_path / "genuine", tmp_path / "home"
    for folder in ("genuine/rospy", "ws/src", "ws/devel"):
        (tmp_path / folder).mkdir(parents=True)
    for file in (genuine / "rospy" / "__init__.py", home, tmp_path / "ws" / "devel" / ".catkin"):
        file.write_text("")
    monkeypatch.chdir(tmp_path / "ws" / "src")
    variables = {
        "ROS_MASTER_URI": "http://no.such.host.invalid:11311", "ROS_IP": "192.0.2.77",
        "ROS_PACKAGE_PATH": str(tmp_path / "gone"), "PYTHONPATH": str(genuine), "ROS_HOME": str(home),
        "ROS_VERSION": "2",
    }  # fmt: skip
    findings = check_machine(gather_machine(variables, timeout_s=30.0))
    assert {finding.rule for finding in findings} >= {
        "master-host-unknown", "ip-of-another", "missing-path", "mixed-python", "cannot-write",
        "ros-2-environment", "workspace-not-set-up",
    }  # fmt: skip


def test_a_full_disk_is_named(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(total=1, free=0))
    machine = gather_machine({"ROS_HOME": str(tmp_path), "ROS_MASTER_URI": "http://127.0.0.1:1"}, timeout_s=1)
    (found,) = (each for each in check_machine(machine) if each.rule == "cannot-write")
    assert "is a folder on a full disk: no logs" in found.summary
    assert found.cure == "Free some space, or set ROS_HOME to a writable one."


def test_programs_of_another_ros_are_distinguished_from_those_of_pipros(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("pipros_tools.health.gather_machine.COMMANDS", ("roscore", "rostopic", "rosnode"))
    programs = {"roscore": "import roslaunch", "rostopic": "from pipros_tools.cli.rostopic import main"}
    for name, text in programs.items():
        (tmp_path / name).write_text(f"#!/usr/bin/python3\n{text}\n")
        (tmp_path / name).chmod(0o755)
    machine = gather_machine({"PATH": str(tmp_path), "ROS_MASTER_URI": "http://127.0.0.1:1"}, timeout_s=1.0)
    assert machine.foreign_programs == {"roscore": tmp_path / "roscore"}


# Why no data arrives on a topic: for each step of a message, a running system in which it fails.


def checked(master: Master, topic: str, wait_s: float = 2.0) -> TopicCheck:
    environment = Environment(master_uri=master.uri)
    return check_topic(gather_topic(topic, environment, wait_s=wait_s, timeout_s=30.0))


def failed_step(check: TopicCheck) -> tuple[str, str]:
    """Return the name of the step that failed, and the rule. All others before it have passed."""
    assert check.finding is not None, check
    assert [each.name for each in check.steps] == [name for name, _ in STEPS][: len(check.steps)]
    return check.steps[-1].name, check.finding.rule


def test_all_steps_of_a_healthy_topic_pass(master: Master, make_node: MakeNode) -> None:
    talker = make_node("talker")
    publisher = talker.advertise("/chatter", String)
    wait_until_connected(make_node("listener").subscribe("/chatter", String, lambda _: None))
    with repeating(lambda: publisher.publish(String("hello"))):
        check = checked(master, "/chatter")
    assert check.finding is None, check
    assert (check.type, len(check.steps)) == ("std_msgs/String", len(STEPS))
    assert "1 of 1 exists" in [each.text for each in check.steps]


OTHER = type("String", (String,), {"_md5sum": "0" * 32})


@pytest.mark.parametrize(
    ("published", "subscribed", "failed", "texts"),
    [
        (None, ("/scan", String), ("publisher", "no-publishers"), ()),
        (("/scan", String), None, ("publisher", "no-publishers"), ("does not exist",)),
        (("/image_raw", String), ("/image_rect", String), ("publisher", "similar-topic"), ("/image_raw",)),
        (("/a", String), ("/a", Int32), ("types", "type-mismatch"), (String._type, Int32._type)),
        (("/a", String), ("/a", OTHER), ("types", "md5-mismatch"), ()),
    ],
    ids=["no publisher", "unknown topic", "similar name", "another type", "another definition"],
)
def test_a_topic_that_does_not_fit(master, make_node, published, subscribed, failed, texts) -> None:
    if published:
        make_node("talker").advertise(*published)
    if subscribed:
        make_node("listener").subscribe(*subscribed, lambda _: None)
    check = checked(master, subscribed[0] if subscribed else "/nothing_like_it")
    assert failed_step(check) == failed
    assert all(text in check.steps[-1].text for text in texts)


def test_a_service_is_named_as_one(master: Master, make_node: MakeNode) -> None:
    make_node("camera").serve("/capture", Empty, lambda _: EmptyResponse())
    check = checked(master, "/capture", 0.1)
    assert failed_step(check) == ("publisher", "service")
    assert "[/camera]" in check.finding.summary


def test_a_subscriber_that_has_not_connected(master: Master, make_node: MakeNode) -> None:
    make_node("talker").advertise("/chatter", String)
    deaf = make_node("deaf")  # registered by hand, so it is not told of publishers
    register_as(master, "/other", "registerSubscriber", "/chatter", "std_msgs/String", deaf.uri)
    environment = Environment(master_uri=master.uri)
    facts = gather_topic("/chatter", environment, wait_s=0.1, timeout_s=2.0)
    assert failed_step(check_topic(facts)) == ("connections", "subscriber-cannot-reach")


def test_a_publisher_that_has_ended(master: Master, make_node: MakeNode) -> None:
    register_as(master, "/ghost", "registerPublisher", "/scan", "sensor_msgs/LaserScan", NOBODY)
    assert failed_step(checked(master, "/scan", 0.1)) == ("addresses", "ghost-node")


def test_a_publisher_that_waits_for_its_own_input(master: Master, make_node: MakeNode) -> None:
    detector = make_node("detector")
    detector.advertise("/detections", String)
    detector.subscribe("/image", String, lambda _: None)
    check = checked(master, "/detections", 0.2)
    assert failed_step(check) == ("messages", "no-message")
    assert "no node publishes [/image]" in check.finding.cure


def test_a_publisher_that_has_stopped(master: Master, make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("/chatter", String)
    sent: list[int] = []

    def publish() -> None:
        if publisher.connection_count and len(sent) < 20:
            sent.append(0)
            publisher.publish(String("hello"))

    with repeating(publish, 0.01):
        check = checked(master, "/chatter", 6.0)
    assert failed_step(check) == ("rate", "stopped")


def test_stamps_of_another_clock(master: Master, make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("/pose", PoseStamped)
    with repeating(lambda: publisher.publish(pose(Time(1_000_000_000)))):
        check = checked(master, "/pose")
    assert failed_step(check) == ("stamp", "stamps-differ")


def test_a_frame_without_a_transform(master: Master, make_node: MakeNode) -> None:
    node = make_node("talker")
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = "map", "base_link"
    node.advertise("/tf_static", TFMessage, latch=True).publish(TFMessage([transform]))
    assert "1 message in 2.0 s" in [each.text for each in checked(master, "/tf_static").steps]
    publisher = node.advertise("/pose", PoseStamped, latch=True)
    publisher.publish(pose(Time(1), "base_lnk"))
    check = checked(master, "/pose")
    assert failed_step(check) == ("frame", "unknown-frame")
    assert "[base_link]" in check.finding.cure
    publisher.publish(pose(Time(1), "/base_link"))
    assert checked(master, "/pose").finding is None
    publisher.publish(pose(Time(1), ""))
    assert failed_step(checked(master, "/pose")) == ("frame", "no-frame")
    node.advertise("/joints", JointState, latch=True).publish(JointState(header=Header(0, Time(1), "")))
    assert checked(master, "/joints").finding is None


def test_a_subscriber_that_drops_messages(master: Master, make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("/chatter", String)
    has_ended = threading.Event()
    slow = make_node("slow")
    slow.subscribe("/chatter", String, lambda _: has_ended.wait(0.05), queue_size=1)

    def has_dropped() -> bool:
        found = slow.endpoints.subscription("/chatter")
        return found is not None and any(link.link.statistics.dropped for link in found.links)

    with repeating(lambda: publisher.publish(String("hello")), 0.005):
        wait_until(has_dropped)
        check = checked(master, "/chatter")
        has_ended.set()
    assert failed_step(check) == ("queues", "dropped")
    assert "[/slow]" in check.steps[-1].text


def test_the_command_prints_the_steps_and_the_remedy(master: Master, make_node: MakeNode, capsys) -> None:
    make_node("detector").advertise("/detections", String)
    assert doctor.main(["/detections", "--wait", "0.1"]) == 1
    printed = capsys.readouterr().out
    assert printed.startswith("/detections (std_msgs/String)\n  publisher    [/detector] publishes it\n")
    assert "What to do:" in printed
    assert printed.endswith("[no-message]\n\n")

    assert doctor.main(["/detections", "--wait", "0.1", "--json"]) == 1
    (found,) = json.loads(capsys.readouterr().out)
    assert (found["topic"], found["finding"]["rule"]) == ("/detections", "no-message")

    node = make_node("latching")
    node.advertise("/hello", String, latch=True).publish(String("hello"))
    assert doctor.main(["/hello", "--wait", "0.5"]) == 0
    assert capsys.readouterr().out.endswith("\n\nNothing is wrong.\n")


def test_topics_and_programs_are_not_mixed(capsys: pytest.CaptureFixture[str]) -> None:
    assert doctor.main(["/chatter", "no such/file.py"]) == 1
    assert "/chatter is a topic" in capsys.readouterr().err
