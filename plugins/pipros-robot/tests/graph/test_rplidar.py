"""`rplidarNode` with a simulated RPLIDAR on a pseudo-terminal. Never tried with a real device."""

import contextlib
import math
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem
from tests.support.simulated_rplidar import SimulatedRplidar
from tests.support.waiting import wait_until

LaserScan: Any = load_message_class("sensor_msgs/LaserScan")
MakeLidar = Callable[..., SimulatedRplidar]
STANDARD, EXPRESS, ULTRA, DENSE, ULTRA_DENSE = range(5)


def room(angle: float) -> float:
    """1 to 8.2 m, more at larger angles, and nothing at 200 to 210 degrees."""
    return 0 if 200 < angle < 210 else 1000 + 20 * angle


@pytest.fixture
def make_lidar(tmp_path: Path) -> Iterator[MakeLidar]:
    made: list[SimulatedRplidar] = []

    def make(**settings: Any) -> SimulatedRplidar:
        made.append(SimulatedRplidar(tmp_path / "ttyUSB0", room, **settings))
        return made[-1]

    yield make
    for each in made:
        each.unplug()


@pytest.fixture
def scans(ros: RosSystem) -> Iterator[Inbox]:
    ros.serve_master()
    inbox = Inbox()
    with Node("viewer", environment=Environment(master_uri=ros.master_uri)) as node:
        node.subscribe("/scan", LaserScan, inbox)
        yield inbox


def expected_range(scan: Any, index: int) -> float:
    """Return the range in the room in the direction of a beam. Angles of the device are clockwise."""
    angle = scan.angle_min + index * scan.angle_increment
    return room(math.degrees(math.pi - angle) % 360) / 1000 or math.inf


@pytest.mark.parametrize("mode", [STANDARD, EXPRESS, DENSE, ULTRA_DENSE])
def test_a_launch_file_publishes_the_room(
    ros: RosSystem, scans: Inbox, make_lidar: MakeLidar, mode: int
) -> None:
    lidar = make_lidar(typical=mode, samples=800)
    launch = ros.pipros.start("roslaunch", "rplidar_ros", "rplidar_a1.launch", f"serial_port:={lidar.path}")
    scan = scans.wait(4)[2]
    assert scan.header.frame_id == "laser"
    assert (scan.angle_min, scan.angle_max) == (pytest.approx(-math.pi), pytest.approx(math.pi))
    assert (scan.range_min, scan.range_max) == (pytest.approx(0.15), 12.0)
    assert len(scan.ranges) == len(scan.intensities) == 800 + 360
    for index in range(20, len(scan.ranges) - 20, 7):
        expected = expected_range(scan, index)
        if math.isfinite(expected) and math.isfinite(expected_range(scan, index - 15)):
            assert scan.ranges[index] == pytest.approx(expected, abs=0.05), index
    empty = [math.isinf(scan.ranges[index]) for index in range(len(scan.ranges))]
    assert 20 <= sum(empty) <= 40
    # On a busy machine, reading a scan takes longer, or no time if it was in the buffer.
    wait_until(lambda: any(0.05 < each.scan_time < 0.15 for each in scans.messages), what="a scan of 0.1 s")
    assert scan.time_increment == pytest.approx(scan.scan_time / 1159)
    launch.press_ctrl_c()
    assert launch.wait() == 0
    assert "Traceback" not in launch.output
    assert not lidar.is_scanning


def test_without_compensation_a_scan_has_the_points_of_a_turn(
    ros: RosSystem, scans: Inbox, make_lidar: MakeLidar
) -> None:
    lidar = make_lidar()
    node = ros.pipros.start_node(
        "rplidar_ros", "rplidarNode", f"_serial_port:={lidar.path}", "_inverted:=true"
    )
    scan = scans.wait()[0]
    assert (scan.header.frame_id, len(scan.ranges)) == ("laser_frame", 360)
    assert scan.angle_min == pytest.approx(math.pi - math.radians(359))
    assert scan.angle_max == pytest.approx(math.pi)
    expected = [room(angle) / 1000 or math.inf for angle in range(360)]
    assert scan.ranges == pytest.approx(expected)
    assert list(scan.intensities) == [15.0] * 360
    node.press_ctrl_c()
    assert node.wait() == 0


MOTORS = [
    # an S series by the frequency; a board with power; that of newer firmware by the desired value
    ({"model": 0x61}, (0xA8, b"\xe8\x03"), (0xA8, b"\0\0")),
    ({"model": 0x28, "has_board": True, "firmware": (1, 20)}, (0xF0, b"\x94\x02"), (0xF0, b"\0\0")),
    ({"model": 0x28, "has_board": True}, (0xF0, b"\xbc\x02"), (0xF0, b"\0\0")),
]


@pytest.mark.parametrize(("settings", "starts", "stops"), MOTORS)
def test_services_stop_and_start_the_motor(
    ros: RosSystem,
    scans: Inbox,
    make_lidar: MakeLidar,
    settings: dict[str, Any],
    starts: tuple[int, bytes],
    stops: tuple[int, bytes],
) -> None:
    lidar = make_lidar(**settings)
    node = ros.pipros.start_node(
        "rplidar_ros", "rplidarNode", f"_serial_port:={lidar.path}", f"_scan_frequency:={1000 / 60}"
    )
    scans.wait()
    assert starts in lidar.requests
    assert stops not in lidar.requests
    assert ros.pipros.run("rosservice", "call", "/stop_motor").returncode == 0
    wait_until(lambda: stops in lidar.requests and not lidar.is_scanning)
    seen = lidar.requests.count(starts)
    before = len(scans.messages)
    assert ros.pipros.run("rosservice", "call", "/start_motor").returncode == 0
    scans.wait(before + 2)
    assert lidar.requests.count(starts) == seen + 1
    node.press_ctrl_c()
    assert (node.wait(), lidar.requests[-2]) == (0, stops)


def test_a_lidar_without_motor_control_of_its_own_has_a_line_for_it(tmp_path: Path) -> None:
    from pipros_robot.perception.drivers.rplidar.lidar import Lidar
    from pipros_robot.perception.drivers.streams import serial_port

    device = SimulatedRplidar(tmp_path / "tty", room)
    stream = serial_port(str(device.path), 115200).open()
    lines: list[bool] = []
    stream.set_dtr = lines.append  # type: ignore[method-assign]
    try:
        lidar = Lidar(stream, "tty", lambda: False)
        lidar.turn_motor(10.0)
        lidar.turn_motor(0)
    finally:
        stream.close()
        device.unplug()
    assert lines == [False, True]


def test_unplugging_is_reported_once_and_scans_come_again(
    ros: RosSystem, scans: Inbox, make_lidar: MakeLidar
) -> None:
    lidar = make_lidar()
    node = ros.pipros.start_node("rplidar_ros", "rplidarNode", f"_serial_port:={lidar.path}")
    scans.wait()
    lidar.unplug()
    node.wait_for("ttyUSB0.*Trying again until it works")
    lidar.plug_in()
    before = len(scans.messages)
    node.wait_for("ttyUSB0 works again")
    scans.wait(before + 1)
    assert node.output.count("Trying again") == 1
    node.press_ctrl_c()
    assert node.wait() == 0


@pytest.mark.parametrize(
    "garbage", [b"\xa5", b"\xa0\x50\xff\xff" * 100, bytes(range(256)) * 4, b"\x3e\x01\0\0\0"]
)
def test_a_node_with_garbage_goes_on_when_it_ends(
    ros: RosSystem, scans: Inbox, make_lidar: MakeLidar, garbage: bytes
) -> None:
    lidar = make_lidar(typical=EXPRESS)
    lidar.garbage = garbage
    node = ros.pipros.start_node("rplidar_ros", "rplidarNode", f"_serial_port:={lidar.path}")
    node.wait_for("sends no whole turns; the head may be blocked. Trying again")
    lidar.garbage = b""
    scans.wait(3)
    node.press_ctrl_c()
    assert (node.wait(), node.output.count("Trying again")) == (0, 1)
    assert "Traceback" not in node.output


def test_a_silent_or_broken_device_is_asked_again(
    ros: RosSystem, scans: Inbox, make_lidar: MakeLidar
) -> None:
    lidar = make_lidar()
    lidar.is_silent = True
    node = ros.pipros.start_node("rplidar_ros", "rplidarNode", f"_serial_port:={lidar.path}")
    node.wait_for("does not answer GET_INFO like an RPLIDAR; the baud rate may be wrong. Trying again")
    lidar.is_silent = False
    scans.wait()
    lidar.unplug()
    lidar.health = (2, 0x8001)
    lidar.plug_in()
    node.wait_for(r"reports an internal error \(code 0x8001\); power-cycle it. Trying again")
    lidar.health = (1, 7)
    before = len(scans.messages)
    node.wait_for("problem 0x0007")
    scans.wait(before + 1)
    node.press_ctrl_c()
    assert node.wait() == 0


def test_an_unknown_mode_is_named_with_the_others(ros: RosSystem, make_lidar: MakeLidar) -> None:
    ros.serve_master()
    lidar = make_lidar()
    port = f"_serial_port:={lidar.path}"
    node = ros.pipros.start_node(
        "rplidar_ros", "rplidarNode", port, "_scan_mode:=Fast", "_initial_reset:=true"
    )
    node.wait_for("no scan mode Fast. ~scan_mode can be Standard, Express, Boost, DenseBoost, UltraDense")
    assert 0x40 in lidar.commands()
    node.press_ctrl_c()
    assert node.wait() == 0


@pytest.mark.parametrize(("mode", "firmware"), [("", (1, 20)), ("Standard", (1, 20)), ("", (1, 15))])
def test_old_firmware_has_two_modes_or_one(
    ros: RosSystem, scans: Inbox, make_lidar: MakeLidar, mode: str, firmware: tuple[int, int]
) -> None:
    lidar = make_lidar(firmware=firmware)
    arguments = [f"_serial_port:={lidar.path}", f"_scan_mode:={mode!r}"]
    node = ros.pipros.start_node("rplidar_ros", "rplidarNode", *arguments)
    scans.wait()
    is_express = firmware == (1, 20) and not mode
    assert (0x82 if is_express else 0x20, bytes(5 * is_express)) in lidar.requests
    node.wait_for(r"Express: 4\.0 kHz, up to 16\.0 m" if is_express else r"Standard: 2\.0 kHz, up to 16\.0 m")
    node.press_ctrl_c()
    assert node.wait() == 0


@pytest.mark.parametrize("fault", ["none", "missing", "silent", "garbage", "nothing more"])
@pytest.mark.parametrize("at", ["INFO", "works again|Trying|kHz"])
def test_ctrl_c_ends_the_node_whatever_the_device_does(
    ros: RosSystem, make_lidar: MakeLidar, fault: str, at: str
) -> None:
    ros.serve_master()
    lidar = make_lidar()
    lidar.is_silent = fault == "silent"
    lidar.garbage = b"\xa5" * 1000 if fault == "garbage" else b""
    path = lidar.path if fault != "missing" else lidar.path.with_name("none")
    node = ros.pipros.start_node("rplidar_ros", "rplidarNode", f"_serial_port:={path}")
    ros.wait_for_publisher("/scan")
    if at != "INFO":
        node.wait_for(at)
    if fault == "nothing more":
        lidar.is_silent = True
    node.press_ctrl_c()
    assert node.wait() == 0
    assert "Traceback" not in node.output


@contextlib.contextmanager
def relayed(lidar: SimulatedRplidar, kind: socket.SocketKind) -> Iterator[int]:
    """Serve a device's port over the network, as adapters do. Yield the number of the port."""
    ends = threading.Event()
    with socket.socket(socket.AF_INET, kind) as server, open(lidar.path, "r+b", buffering=0) as port:
        server.bind(("127.0.0.1", 0))
        if kind is socket.SOCK_STREAM:
            server.listen()

        def to_device(receive: Callable[[], tuple[bytes, Any]], connection: socket.socket) -> None:
            with contextlib.suppress(OSError):
                while data := receive():
                    peers[:] = [data[1]]
                    connections[:] = [connection]
                    if not data[0]:
                        return
                    port.write(data[0])

        peers: list[Any] = []
        connections: list[socket.socket] = []

        def from_device() -> None:
            with contextlib.suppress(OSError, ValueError):
                while not ends.is_set():
                    data = port.read(1000)
                    for connection in connections:
                        if kind is socket.SOCK_STREAM:
                            connection.sendall(data)
                        else:
                            connection.sendto(data, peers[0])

        def serve() -> None:
            with contextlib.suppress(OSError):
                if kind is socket.SOCK_DGRAM:
                    to_device(lambda: server.recvfrom(1000), server)
                else:
                    connection, _ = server.accept()
                    with connection:
                        to_device(lambda: (connection.recv(1000), None), connection)

        for target in (serve, from_device):
            threading.Thread(target=target, daemon=True).start()
        yield server.getsockname()[1]
        ends.set()
        with contextlib.suppress(OSError):
            server.shutdown(socket.SHUT_RDWR)


@pytest.mark.parametrize("channel", ["tcp", "udp"])
def test_a_lidar_on_the_network(ros: RosSystem, scans: Inbox, make_lidar: MakeLidar, channel: str) -> None:
    kind = socket.SOCK_STREAM if channel == "tcp" else socket.SOCK_DGRAM
    with relayed(make_lidar(), kind) as port:
        launch = ros.pipros.start(
            *("roslaunch", "rplidar_ros", "rplidar.launch", f"channel_type:={channel}"),
            *(f"{channel}_ip:=127.0.0.1", f"{channel}_port:={port}"),
        )
        scan = scans.wait(2)[1]
        assert scan.ranges[len(scan.ranges) // 2] == pytest.approx(
            expected_range(scan, len(scan.ranges) // 2), abs=0.1
        )
        launch.press_ctrl_c()
        assert launch.wait() == 0


def test_without_the_extra_one_line_names_it(ros: RosSystem, tmp_path: Path) -> None:
    ros.serve_master()
    (tmp_path / "none").mkdir()
    (tmp_path / "none" / "serial.py").write_text('raise ModuleNotFoundError("no serial", name="serial")')
    node = ros.pipros.start(*ros.pipros.node("rplidar_ros", "rplidarNode"), PYTHONPATH=str(tmp_path / "none"))
    assert (node.wait(), len(node.lines)) == (1, 1)
    node.wait_for(r"serial ports need pyserial, which is not installed. Try: .*pip install .*\[drivers\]")
