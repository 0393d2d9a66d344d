"""Calls of other machines and other users that nodes, masters and launchers refuse."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from tests.support.launch_parent import Parent, launch, start
from tests.support.network import FarNetwork, needs_network
from tests.support.programs import make_programs
from tests.support.ros import RosSystem
from tests.support.users import STRANGER, needs_other_users
from tests.support.waiting import wait_until

SLEEPER = """
import rospy
rospy.init_node("sleeper")
rospy.Subscriber("chat", rospy.AnyMsg, print)
rospy.spin()
"""

# Without modules beyond the standard library's, which another user may not be able to read.
ORDER = """
import http.client, os, sys, xmlrpc.client, encodings.idna
port, user, text = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
os.setgid(user)
os.setuid(user)
try:
    print(xmlrpc.client.ServerProxy(f"http://127.0.0.1:{port}").launch(text))
except (OSError, http.client.HTTPException) as error:
    print("refused", type(error).__name__)
"""


@pytest.fixture
def far() -> Iterator[FarNetwork]:
    network = FarNetwork()
    yield network
    network.close()


@needs_network
def test_rosnode_kill_on_another_machine_reports_the_refusal(far: FarNetwork, ros: RosSystem) -> None:
    uri = f"http://{far.near}:{ros.port}"
    ros.pipros.environment["ROS_MASTER_URI"] = uri
    ros.master_uri = uri
    core = ros.pipros.start("roscore", "-p", str(ros.port), ROS_IP=far.near)
    core.wait_for(r"started core service \[/rosout\]")
    (ros.home / "sleeper.py").write_text(SLEEPER)
    sleeper = ros.pipros.start("python", "sleeper.py", ROS_IP=far.near)
    ros.wait_for_subscriber("/chat")

    killed = ros.pipros.run(*far.command("rosnode", "kill", "/sleeper"), ROS_IP=far.far)
    assert killed.returncode == 1
    assert killed.stderr[0].startswith(f"ERROR: /sleeper: http://{far.near}:")
    assert f"from this node's machine, not from {far.far}" in killed.stderr[0]
    assert killed.stderr[1:] == ["ERROR: Failed to kill:", " * /sleeper"]
    assert sleeper.is_running
    assert "shutdown of [/rosnode" in sleeper.wait_for(f"shutdown of .* came from {far.far}").string

    assert ros.pipros.run("rosnode", "kill", "/sleeper", ROS_IP=far.near).returncode == 0
    assert sleeper.wait() == 0


@needs_network
def test_a_master_lets_in_and_obeys_its_own_machine_by_each_address(far: FarNetwork) -> None:
    ended: list[str] = []
    master = Master(
        host="0.0.0.0",  # noqa: S104
        port=0,
        allow=["198.51.100.0/24"],
        on_shutdown=ended.append,
    )
    with master:
        refused = subprocess.run(
            far.command(
                sys.executable,
                "-c",
                f"import socket; print(socket.create_connection(('{far.near}', {master.port}), 10).recv(1))",
            ),
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert "ConnectionResetError" in refused.stderr or refused.stdout == "b''\n"
        client = MasterClient(f"http://{far.near}:{master.port}", "/test", timeout_s=30)
        assert client.get_pid() == os.getpid()
        assert client.call("shutdown", "the end") == 0
        wait_until(lambda: ended)
        client.close()


@pytest.fixture
def parent() -> Iterator[Parent]:
    parent = Parent()
    yield parent
    parent.end()


@pytest.fixture
def package(ros: RosSystem) -> Path:
    folder = make_programs(ros.home / "programs", {"sleeper": "#!/bin/sh\nexec sleep 1000\n"})
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(folder)
    return folder


@needs_other_users
@pytest.mark.usefixtures("package")
def test_another_user_cannot_have_a_roslaunch_child_start_programs(ros: RosSystem, parent: Parent) -> None:
    start(ros, parent)
    port = parent.child.uri.rpartition(":")[2].strip("/")
    text = '<launch><node pkg="programs" name="theirs" type="sleeper"/></launch>'

    def order(user: int) -> str:
        ran = subprocess.run(
            [sys.executable, "-c", ORDER, port, str(user), text],
            capture_output=True, text=True, timeout=60, check=True,
        )  # fmt: skip
        return ran.stdout

    assert order(STRANGER).startswith("refused ")
    assert launch(parent, ("ours", "sleeper"))[0] == 1  # so the first one was the other
    assert "has already launched its nodes" in order(0)
