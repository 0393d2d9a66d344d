"""A signal ends every program at any moment of its start, also while its master accepts and is silent.

`script/long signals` does this at ten moments, and prints the times, of which half a second is promised. Here
each program is ended when it waits, and at one moment before, which the seed chooses (`PIPROS_TEST_SEED`;
default: the date).
"""

import os
import random
import signal
import sys
from datetime import datetime, timezone
from pathlib import Path

import pytest

from tests.support.every_program import (
    EVERY,
    MOMENTS_MS,
    NUMBERS,
    WAITS_MS,
    end_program,
)
from tests.support.ports import ClaimedPort
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.slaves import SilentSlave
from tests.support.waiting import wait_until

SEED = os.environ.get("PIPROS_TEST_SEED") or datetime.now(timezone.utc).date().isoformat()


@pytest.mark.parametrize("command", EVERY)
def test_a_signal_ends_this_program(command: str, tmp_path: Path) -> None:
    chance = random.Random(f"{SEED} {command}")  # noqa: S311
    port = ClaimedPort()
    try:
        for moment in (chance.choice(MOMENTS_MS[:-1]), WAITS_MS):
            ended = end_program(command, moment, chance.choice(NUMBERS), tmp_path, port=port.number)
            assert not ended.complaint, f"seed {SEED}: {ended.complaint}"
    finally:
        port.release()


# Python 3.14 ends by SIGINT after any KeyboardInterrupt, and `ROSInterruptException` is one.
INTERRUPTED_START = 1 if sys.version_info < (3, 14) else -signal.SIGINT


@pytest.mark.parametrize("node", ["fibonacci_server", "averaging_server"])
def test_ctrl_c_in_init_node_prints_no_traceback(ros: RosSystem, node: str) -> None:
    silent = SilentSlave()
    for uri in (ros.master_uri, silent.api):  # no master, and one that does not respond
        program = ros.pipros.start("rosrun", "actionlib_tutorials", node, ROS_MASTER_URI=uri)
        if uri == silent.api:
            wait_until(lambda: silent.connections)
        else:
            program.wait_for("Unable to register with master node")
        program.press_ctrl_c()

        program.check(INTERRUPTED_START)
    silent.stop()


def waiting_launch(ros: RosSystem, master: SilentSlave) -> Process:
    file = ros.home / "node.launch"
    file.write_text("<launch/>")
    return ros.pipros.start("roslaunch", "--wait", str(file), ROS_MASTER_URI=master.api)


def test_roslaunch_that_waits_says_that_the_port_is_in_use(ros: RosSystem) -> None:
    master = SilentSlave()
    launch = waiting_launch(ros, master)
    launch.wait_for("the port of ROS_MASTER_URI .* is in use, but no master responds there")
    launch.press_ctrl_c(code=130)
    assert "auto-starting new master" not in launch.output
    assert "Traceback" not in launch.output
    master.stop()


def test_ctrl_c_ends_roslaunch_that_waits_for_a_master(ros: RosSystem) -> None:
    (ros.home / "node.launch").write_text("<launch/>")
    launch = ros.pipros.start("roslaunch", "--wait", str(ros.home / "node.launch"))
    launch.wait_for("roscore/master is not yet running")
    launch.press_ctrl_c(code=130)
    assert "auto-starting new master" not in launch.output
