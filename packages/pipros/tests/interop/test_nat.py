"""Nodes of pipros behind routers that map ports to them, as in containers, and genuine ROS outside."""

import json
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.network import NatNetwork, needs_network
from tests.support.processes import Process
from tests.support.ros import RosSystem, Side
from tests.support.sshd import SSHD, SshServer

pytestmark = [needs_network, pytest.mark.skipif(shutil.which("nft") is None, reason="needs nftables")]

PROGRAMS = Path(__file__).parent / "programs"
OFFER, USE = str(PROGRAMS / "offer_everything.py"), str(PROGRAMS / "use_everything.py")
MASTER_PORT = 11311
PORTS = "11400-11409"
OTHER_RULES = {"mixed-programs", "mixed-paths"}
MAPPED = {31400 + number: 11400 + number for number in range(10)} | {21311: MASTER_PORT}

LAUNCH = """\
<launch>
  <machine name="far" address="{address}" ssh-port="31022" env-loader="{loader}" timeout="60"/>
  <node machine="far" pkg="composiv_tryouts" type="composiv_talker.py" name="talker" output="screen"/>
</launch>
"""


class World:
    """An open host with genuine ROS, and two hosts behind routers with pipros."""

    def __init__(self, ros: RosSystem) -> None:
        self.ros = ros
        self.network = NatNetwork([MAPPED, MAPPED])
        for side in (ros.pipros, ros.genuine):
            for name in ("ROS_IP", "ROS_HOSTNAME"):
                side.environment.pop(name, None)
        self.set_master(f"http://{self.network.open}:{MASTER_PORT}")
        ros.genuine.environment["ROS_IP"] = self.network.open

    def set_master(self, uri: str) -> None:
        self.ros.pipros.environment["ROS_MASTER_URI"] = self.ros.genuine.environment["ROS_MASTER_URI"] = uri

    def inside(self, host: int) -> dict[str, str]:
        mapped = f"{self.network.mapped[host]}:31400-31409,21311={MASTER_PORT}"
        return {"PIPROS_PORTS": PORTS, "PIPROS_ADVERTISE": mapped}

    def start(self, host: int | None, *argv: str, **more: str) -> Process:
        """A program of genuine ROS on the open host, of pipros behind a router."""
        side, variables = self._of(host)
        return side.start(*self.network.command(host, *argv), **variables, **more)

    def run(self, host: int | None, *argv: str) -> list[str]:
        side, variables = self._of(host)
        ended = side.run(*self.network.command(host, *argv), timeout_s=120, **variables)
        assert ended.returncode == 0, ended.output
        return ended.stdout

    def side(self, host: int | None) -> Side:
        return self.ros.genuine if host is None else self.ros.pipros

    def _of(self, host: int | None) -> tuple[Side, dict[str, str]]:
        return self.side(host), {} if host is None else self.inside(host)

    def offer(self, host: int | None, name: str) -> Process:
        process = self.start(host, *self.python(host), OFFER, f"__name:={name}")
        process.wait_for("offers everything")
        return process

    def use(self, host: int | None, *names: str) -> None:
        assert self.run(host, *self.python(host), USE, *names)[-len(names) :] == [f"used {n}" for n in names]

    def python(self, host: int | None) -> tuple[str, ...]:
        return ("/usr/bin/python3",) if host is None else ("python",)


@pytest.fixture
def world(ros: RosSystem) -> Iterator[World]:
    world = World(ros)
    yield world
    world.network.close()


def test_everything_works_across_nat_with_genuine_nodes_and_master(world: World) -> None:
    core = world.start(None, "roscore", "-p", str(MASTER_PORT))
    core.wait_for("started core service")
    world.offer(0, "/first")
    world.offer(1, "/second")
    world.offer(None, "/open")
    world.use(None, "/first", "/second")
    world.use(0, "/open", "/first", "/second")
    assert "/first" in "".join(world.run(None, "rosnode", "ping", "-c", "1", "/first"))
    bag = world.ros.home / "inside.bag"
    world.run(0, "rosbag", "record", "-O", str(bag), "--limit=1", "/open/latched", "/second/latched")
    topics = world.run(0, "rostopic", "list", "-b", str(bag))
    assert {"/open/latched", "/second/latched"} <= set(topics)
    echo = world.start(None, "rostopic", "echo", "-n", "1", "/played")
    world.start(0, "rosbag", "play", "--loop", str(bag), "/open/latched:=/played")
    assert echo.wait(60) == 0
    assert "data: " in echo.output


def test_cpp_nodes_talk_and_listen_across_nat(world: World) -> None:
    world.start(None, "roscore", "-p", str(MASTER_PORT)).wait_for("started core service")
    genuine, pipros = world.ros.genuine, world.ros.pipros
    listening = world.start(None, *genuine.node("cpp_battery", "battery_listener"), "__name:=cpp_listener")
    talking = world.start(0, *pipros.node("composiv_tryouts", "composiv_talker.py"))
    listening.wait_for(r"^heard %25 from /")
    talking.press_ctrl_c()
    assert talking.wait() == 0
    hearing = world.start(0, *pipros.node("composiv_tryouts", "composiv_listener.py"))
    world.start(None, *genuine.node("cpp_battery", "battery_talker"), "__name:=cpp_talker")
    hearing.wait_for(r"Battery level of vehicle")
    assert "ros.roscpp" in "".join(world.run(0, "rosservice", "call", "/cpp_talker/get_loggers"))


def test_a_master_behind_nat_serves_genuine_nodes_and_nodes_behind_another_router(world: World) -> None:
    inside, outside = f"http://localhost:{MASTER_PORT}", f"http://{world.network.mapped[0]}:21311"
    world.set_master(inside)
    core = world.start(0, "roscore", "--bind", "0.0.0.0", "-p", str(MASTER_PORT))  # noqa: S104
    core.wait_for("started core service")
    first = world.network.command(0, "python", OFFER, "__name:=/first")
    world.ros.pipros.start(*first, **world.inside(0), ROS_IP="192.168.77.2").wait_for("offers everything")
    world.set_master(outside)
    world.offer(1, "/second")
    world.offer(None, "/open")
    world.use(None, "/first", "/second")
    world.use(1, "/first", "/open")


def test_the_doctor_tells_whether_the_master_reaches_the_advertised_address(world: World) -> None:
    world.start(None, "roscore", "-p", str(MASTER_PORT)).wait_for("started core service")

    def rules(**variables: str) -> set[str]:
        doctor = world.network.command(0, "pipros", "doctor", "--json")
        ended = world.ros.pipros.run(*doctor, timeout_s=60, **variables)
        return {found["rule"] for found in json.loads("\n".join(ended.stdout))["findings"]} - OTHER_RULES

    assert rules(**world.inside(0)) == set()
    assert rules(ROS_IP="192.168.77.2") == {"not-called-back"}
    unmapped = {"PIPROS_PORTS": "11410-11419", "PIPROS_ADVERTISE": world.network.mapped[0]}
    assert rules(**unmapped) == {"not-called-back"}


@pytest.mark.parametrize(("parent", "child"), [(None, 0), (0, 1)], ids=["genuine-and-open", "behind-nat"])
def test_roslaunch_starts_nodes_behind_nat_by_ssh(world, tmp_path, parent: int | None, child: int) -> None:
    if not Path(SSHD).exists() or shutil.which("ssh") is None:
        pytest.skip("openssh-server and openssh-client are needed")
    if parent is not None:
        world.start(None, "roscore", "-p", str(MASTER_PORT)).wait_for("started core service")
    sshd = SshServer(tmp_path / "ssh", "192.168.77.2", world.network.command(child))
    try:
        world.network.map_port(child, 31022, sshd.port)
        variables = {**world.ros.pipros.environment, **world.inside(child)}
        loader = tmp_path / "loader"
        settings = " ".join(f"'{name}={value}'" for name, value in variables.items())
        loader.write_text(f'#!/bin/sh\nexec env -i {settings} "SSH_CLIENT=$SSH_CLIENT" "$@"\n')
        loader.chmod(0o755)
        file = tmp_path / "far.launch"
        file.write_text(LAUNCH.format(address=world.network.mapped[child], loader=loader))
        home = {"HOME": str(sshd.folder), "ROSLAUNCH_SSH_UNKNOWN": "1"}
        tools = tmp_path / "tools"
        tools.mkdir()
        sshd.client(tools, world.network.mapped[child], world.network.mapped[child])
        path = f"{tools}:{world.side(parent).environment['PATH']}"
        running = world.start(parent, "roslaunch", str(file), PATH=path, **home)
        running.wait_for(r"process\[talker-\d\]: started with pid", 60)
        if parent is None:
            running.wait_for(r"\.\.\. done launching nodes", 60)
        hearing = world.start(None, *world.ros.genuine.node("cpp_battery", "battery_listener"))
        hearing.wait_for(r"^heard %25 from /")
        running.send_signal(signal.SIGINT)
        assert running.wait(60) == 0
    finally:
        sshd.close()
