"""`urg_node` with a simulated laser scanner on a TCP port. Never tried with a real device."""

import logging
import math
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from hokuyolx import HokuyoLX

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.nodes.retrying import DeviceError, DevicePort, Driver
from pipros_robot.perception.drivers.streams import Stream, StreamLost
from tests.support.nodes import Inbox, MakeNode, listening_log
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.simulated_urg import Echoes, SimulatedUrg, block, scan_block
from tests.support.waiting import wait_until

LaserScan: Any = load_message_class("sensor_msgs/LaserScan")
MultiEcho: Any = load_message_class("sensor_msgs/MultiEchoLaserScan")
DiagnosticArray: Any = load_message_class("diagnostic_msgs/DiagnosticArray")


def room(step: int) -> Echoes:
    """Up to three echoes at each step, the second of which is the strongest; none at every tenth."""
    echoes = [(1000 + step, 100 + step), (3000 + step, 900), (5000 + step, 50)]
    return echoes[: 1 + step % 3] if step % 10 else []


@pytest.fixture
def make_urg() -> Iterator[Callable[..., SimulatedUrg]]:
    made: list[SimulatedUrg] = []

    def make(**settings: Any) -> SimulatedUrg:
        made.append(SimulatedUrg(room, **settings))
        return made[-1]

    yield make
    for each in made:
        each.unplug()


@pytest.fixture
def urg(make_urg: Callable[..., SimulatedUrg]) -> SimulatedUrg:
    return make_urg()


@pytest.fixture
def viewer(ros: RosSystem) -> Iterator[Node]:
    ros.serve_master()
    with Node("viewer", environment=Environment(master_uri=ros.master_uri)) as node:
        yield node


@pytest.fixture
def scans(viewer: Node) -> Inbox:
    inbox = Inbox()
    viewer.subscribe("/scan", LaserScan, inbox)
    return inbox


def start(ros: RosSystem, urg: SimulatedUrg, *arguments: str) -> Process:
    place = "_ip_address:=127.0.0.1", f"_ip_port:={urg.port}"
    return ros.pipros.start_node("urg_node", "urg_node", *place, *arguments)


def end(node: Process) -> None:
    node.press_ctrl_c()
    assert node.wait() == 0
    assert "Traceback" not in node.output


def test_a_scan_is_that_of_hokuyolx(ros: RosSystem, urg: SimulatedUrg, scans: Inbox) -> None:
    client = HokuyoLX(addr=("127.0.0.1", urg.port), convert_time=False, tsync=False)
    _, theirs = client.get_intens()
    angles = client.get_angles()
    client.close()
    node = start(ros, urg)
    scan = scans.wait()[0]
    distances = np.where(theirs[:, 0] == 0, np.nan, theirs[:, 0] / 1000)
    assert np.allclose(scan.ranges, distances, equal_nan=True)
    assert np.array_equal(scan.intensities, np.where(theirs[:, 0] == 0, 0, theirs[:, 1]))
    assert scan.angle_min + np.arange(1081) * scan.angle_increment == pytest.approx(angles, abs=1e-5)
    assert (scan.angle_max, scan.header.frame_id) == (pytest.approx(angles[-1]), "laser")
    assert (scan.range_min, scan.range_max) == (pytest.approx(client.dmin / 1000), client.dmax / 1000)
    assert scan.scan_time == pytest.approx(1 / client.scan_freq)
    assert scan.time_increment == pytest.approx(scan.scan_time / client.ares)
    end(node)


def test_the_launch_file_measures_the_latency(ros: RosSystem, urg: SimulatedUrg, scans: Inbox) -> None:
    launch = ros.pipros.start(
        "roslaunch", "urg_node", "urg_lidar.launch", "ip_address:=127.0.0.1", f"ip_port:={urg.port}"
    )
    scan = scans.wait()[0]
    assert (scan.angle_min, scan.angle_max) == (pytest.approx(-math.pi / 2), pytest.approx(math.pi / 2))
    assert len(scan.ranges) == 721
    assert not scan.intensities
    assert urg.commands.count("TM1") == 10
    end(launch)


def test_several_echoes(ros: RosSystem, urg: SimulatedUrg, viewer: Node) -> None:
    inboxes = {name: Inbox() for name in ("first", "last", "most_intense", "echoes")}
    for name, inbox in inboxes.items():
        viewer.subscribe(f"/{name}", MultiEcho if name == "echoes" else LaserScan, inbox)
    node = start(ros, urg, "_publish_multiecho:=true", "_synchronize_time:=true")
    first, last, strongest, echoes = (inbox.wait()[0] for inbox in inboxes.values())
    for step in (1, 2, 15, 1079):
        distances = [mm / 1000 for mm, _ in room(step)]
        values = [value for _, value in room(step)]
        assert echoes.ranges[step].echoes == pytest.approx(distances)
        assert list(echoes.intensities[step].echoes) == values
        assert first.ranges[step] == pytest.approx(distances[0])
        assert last.ranges[step] == pytest.approx(distances[-1])
        best = values.index(max(values))
        assert (strongest.ranges[step], strongest.intensities[step]) == (
            pytest.approx(distances[best]),
            values[best],
        )
    assert not echoes.ranges[10].echoes
    assert math.isnan(first.ranges[10])
    assert first.intensities[10] == 0
    assert not ros.publishers("/scan")
    end(node)


def test_settings_change_the_stream_and_the_frame(
    ros: RosSystem, urg: SimulatedUrg, scans: Inbox, viewer: Node
) -> None:
    node = start(ros, urg, "_tf_prefix:=robot", "_angle_max:=9.0", "_publish_intensity:=false")
    scans.wait()
    assert scans.messages[0].header.frame_id == "robot/laser"
    assert viewer.params.get("/urg_node/angle_max") == pytest.approx(3 * math.pi / 4)
    text = "{angle_min: -0.5, angle_max: 0.5, cluster: 4, skip: 1, frame_id: top, time_offset: 5.0}"
    assert (
        ros.pipros.run("rosrun", "dynamic_reconfigure", "dynparam", "set", "urg_node", text).returncode == 0
    )
    wait_until(lambda: len(scans.messages[-1].ranges) == 58, what=lambda: urg.commands[-1])
    scan = scans.messages[-1]
    assert "MD0425065504100" in urg.commands
    assert scan.header.frame_id == "robot/top"
    assert scan.angle_min == pytest.approx((425 - 540) * math.tau / 1440)
    assert scan.angle_increment == pytest.approx(4 * math.tau / 1440)
    assert scan.ranges[0] == pytest.approx(1.425)
    ahead_s = scan.header.stamp.to_sec() - viewer.clock.now_ns() / 1e9
    assert 0 < ahead_s < 5.02
    end(node)


@pytest.mark.parametrize("kinds", [("ME",), ("NE",)])
def test_a_device_without_intensities_sends_distances(
    ros: RosSystem, make_urg: Callable[..., SimulatedUrg], viewer: Node, kinds: tuple[str, ...]
) -> None:
    urg, inbox, has_echoes = make_urg(lacks=kinds), Inbox(), kinds == ("NE",)
    viewer.subscribe("/first" if has_echoes else "/scan", LaserScan, inbox)
    node = start(ros, urg, f"_publish_multiecho:={str(has_echoes).lower()}")
    node.wait_for("does not provide intensities")
    scan = inbox.wait()[0]
    assert scan.ranges[1] == pytest.approx(1.001)
    assert not scan.intensities
    end(node)


def test_a_device_without_several_echoes_is_named(
    ros: RosSystem, make_urg: Callable[..., SimulatedUrg], viewer: Node
) -> None:
    node = start(ros, make_urg(lacks=("ME", "NE", "ND")), "_publish_multiecho:=true")
    node.wait_for(r"127.0.0.1:\d+ cannot send multi-echo scans. Trying again until it works")
    end(node)


def test_losing_the_connection_is_reported_once(ros: RosSystem, urg: SimulatedUrg, scans: Inbox) -> None:
    node = start(ros, urg)
    scans.wait()
    urg.reset()
    node.wait_for(r"lost 127.0.0.1:\d+: .*Trying again until it works")
    node.wait_for("works again")
    mark, before = node.mark(), len(scans.messages)
    urg.unplug()
    node.wait_for("Trying again", since=mark)
    urg.plug_in()
    node.wait_for("works again", since=mark)
    scans.wait(before + 1)
    assert node.output.count("Trying again") == 2
    end(node)


HALF = scan_block("ME0000108001000", "99", 0, [room(step) for step in range(1081)], is_intense=True)[:3000]


@pytest.mark.parametrize(("garbage", "text"), [
    (b"\xff" * 1000, "sends no scans"), (HALF, "sends no scans"),
    (HALF + b"\n\n", "sends too many invalid replies"),
    (block("ME0000108001000", "0L"), "stopped its scans with status 0L"), (b"", "sends no scans"),
])  # fmt: skip
def test_faults_of_a_stream_end_it_but_not_the_node(
    ros: RosSystem, urg: SimulatedUrg, scans: Inbox, garbage: bytes, text: str
) -> None:
    node = start(ros, urg)
    scans.wait()
    urg.garbage, urg.is_silent = garbage, not garbage
    node.wait_for(f"{text}. Trying again until it works")
    urg.garbage, urg.is_silent = b"", False
    before = len(scans.messages)
    node.wait_for("works again")
    scans.wait(before + 1)
    assert node.output.count("Trying again") == 1
    end(node)


def test_diagnostics_tell_the_state_and_the_rate(ros: RosSystem, urg: SimulatedUrg, viewer: Node) -> None:
    found = Inbox()
    viewer.subscribe("/diagnostics", DiagnosticArray, found)
    node = start(ros, urg, "_diagnostics_tolerance:=0.9")

    def newest() -> dict[str, Any]:
        return {each.name: each for each in found.messages[-1].status} if found.messages else {}

    def is_well() -> bool:
        return all(each.level == 0 for each in newest().values()) and bool(found.messages)

    wait_until(is_well, what=lambda: str(newest()))
    hardware, rate = newest()["urg_node: Hardware Status"], newest()["urg_node: Laser Scan topic status"]
    assert (hardware.message, hardware.hardware_id) == ("Streaming", "H1234567")
    values = {each.key: each.value for each in hardware.values}
    assert (values["IP Address"], values["Product Name"]) == ("127.0.0.1", "UST-10LX")
    assert {each.key: each.value for each in rate.values}["Target frequency (Hz)"] == "40.000000"
    urg.unplug()
    wait_until(lambda: newest()["urg_node: Hardware Status"].level == 2)
    assert newest()["urg_node: Hardware Status"].message.startswith("Not Connected: ")
    end(node)


def test_ctrl_c_ends_a_node_whose_device_does_not_answer(
    ros: RosSystem, urg: SimulatedUrg, viewer: Node
) -> None:
    urg.unplug()
    node = start(ros, urg)
    node.wait_for(r"cannot connect to 127.0.0.1:\d+: Connection refused. Trying again")
    end(node)


# A driver outlives every failure of its device, and never delays the end of its node.


class NoStream(Stream):
    """A connection that does nothing."""

    def __init__(self) -> None:
        self.closed = 0

    def close(self) -> None:
        self.closed += 1


def run(driver: Driver) -> tuple[threading.Thread, list[int]]:
    codes: list[int] = []
    thread = threading.Thread(target=lambda: codes.append(driver.run()), daemon=True)
    thread.start()
    return thread, codes


QUICK_S = (0.001, 0.01)


def test_an_outage_is_reported_once_and_so_is_its_end(make_node: MakeNode) -> None:
    node, stream, sessions = make_node("lidar"), NoStream(), []
    log, lines = listening_log()
    log.setLevel(logging.INFO)

    def session(_: Stream) -> None:
        sessions.append(len(sessions))
        if len(sessions) % 10 == 0:
            driver.report_data()
        raise StreamLost("lost /dev/x: gone")

    driver = Driver(node, log, DevicePort("/dev/x", lambda: stream), session, QUICK_S)
    thread, codes = run(driver)
    wait_until(lambda: len(sessions) >= 25)
    node.shutdown()
    thread.join()
    assert codes == [0]
    assert stream.closed == len(sessions)
    lost, works = "lost /dev/x: gone. Trying again until it works.", "/dev/x works again"
    assert lines[:5] == [lost, works, lost, works, lost]
    assert len(lines) <= 2 * len(sessions) // 10 + 1


def test_another_kind_of_failure_is_reported_too(make_node: MakeNode) -> None:
    node, failures = make_node("lidar"), []
    log, lines = listening_log()

    def fail() -> Stream:
        failures.append(len(failures))
        raise DeviceError("too hot") if len(failures) > 5 else StreamLost("not there")

    thread, _ = run(Driver(node, log, DevicePort("x", fail), lambda _: None, QUICK_S))
    wait_until(lambda: len(failures) >= 12)
    node.shutdown()
    thread.join()
    assert lines == [f"{each}. Trying again until it works." for each in ("not there", "too hot")]


@pytest.mark.parametrize("place", ["open", "session"])
def test_the_node_ends_while_the_device_blocks(make_node: MakeNode, place: str) -> None:
    node, blocked, forever = make_node("lidar"), threading.Event(), threading.Event()

    def block(*_: object) -> Stream:
        blocked.set()
        forever.wait()
        return NoStream()

    opened: Callable[[], Stream] = block if place == "open" else NoStream
    driver = Driver(node, logging.getLogger("test"), DevicePort("x", opened), block)
    thread, codes = run(driver)
    assert blocked.wait(60)
    node.shutdown()
    thread.join()
    assert codes == [0]
    assert not forever.is_set()
    forever.set()


def test_the_node_waits_until_the_session_has_stopped_the_motor(make_node: MakeNode) -> None:
    node, begun, stopped = make_node("lidar"), threading.Event(), threading.Event()

    def session(_: Stream) -> None:
        begun.set()
        while not driver.is_ending:
            threading.Event().wait(0.01)
        stopped.set()

    driver = Driver(node, logging.getLogger("test"), DevicePort("x", NoStream), session)
    thread, _ = run(driver)
    wait_until(begun.is_set)
    node.shutdown()
    assert stopped.is_set()
    thread.join()


def test_a_mistake_in_the_driver_ends_the_node_with_an_error(make_node: MakeNode) -> None:
    node = make_node("lidar")
    log, lines = listening_log()

    def session(_: Stream) -> None:
        raise ZeroDivisionError

    driver = Driver(node, log, DevicePort("x", NoStream), session)
    assert (driver.run(), lines) == (1, ["the driver of x failed"])
