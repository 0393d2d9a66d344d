"""Commands that a script starts with `&` end on SIGINT, although the shell made them ignore it."""

from __future__ import annotations

import os
import signal
import sys

import pytest

from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SCRIPT = """
import os, time
open(os.environ["HOME"] + "/ready", "w").close()
time.sleep(60)
"""

NODE = """
import rospy
rospy.init_node("sleeper")
print("up", flush=True)
rospy.spin()
"""


def start_in_background(ros: RosSystem, command: str) -> tuple[Process, int]:
    """Return the shell of a script, and the process of its background job."""
    shell = ros.pipros.start("sh", "-c", f"{command} & echo job $!; wait $!; echo code $?")
    return shell, int(shell.wait_for(r"^job (\d+)$")[1])


@pytest.mark.parametrize(
    ("command", "is_up"),
    [
        ("rostopic echo /said", None),
        ("rostopic echo /nothing", "does not appear to be published yet"),
        ("rostopic hz /said", "subscribed to"),
        ("rostopic bw /said", "subscribed to"),
        ("rostopic delay /said", "subscribed to"),
        ("rostopic pub -v -r 10 /other std_msgs/String x", "publishing"),
        ("rostopic pub /other std_msgs/String x", "publishing and latching"),
        (f"{sys.executable} node.py", "up"),
    ],
)
def test_a_node_in_the_background_of_a_script_ends_on_sigint(
    ros: RosSystem, command: str, is_up: str | None
) -> None:
    (ros.home / "node.py").write_text(NODE)
    ros.pipros.start_master()
    ros.pipros.start("rostopic", "pub", "/said", "std_msgs/String", "x")
    ros.wait_for_publisher("/said")
    shell, job = start_in_background(ros, command)
    if is_up:
        shell.wait_for(is_up)
    else:
        ros.wait_for_subscriber("/said")
    os.kill(job, signal.SIGINT)
    shell.wait_for(r"^code \d+$")


@pytest.mark.parametrize("command", ["rostest slow_test slow.test", "rosunit src/slow_test/slow.py"])
def test_a_test_run_in_the_background_of_a_script_ends_on_sigint(ros: RosSystem, command: str) -> None:
    package = ros.home / "src" / "slow_test"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>slow_test</name></package>")
    (package / "slow.py").write_text(f"#!{sys.executable}\n{SCRIPT}")
    (package / "slow.py").chmod(0o755)
    (package / "slow.test").write_text(
        '<launch><test test-name="slow" pkg="slow_test" type="slow.py"/></launch>'
    )
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(package.parent)
    shell, job = start_in_background(ros, command)
    wait_until(lambda: (ros.home / "ready").exists(), what="the test to run")
    os.kill(job, signal.SIGINT)
    shell.wait_for(r"^code \d+$")


def test_other_commands_keep_ignoring_it_as_noetics_do(ros: RosSystem) -> None:
    ros.pipros.start_master()
    shell, job = start_in_background(ros, "rosnode ping -c 3 /rosout")
    shell.wait_for("xmlrpc reply")
    os.kill(job, signal.SIGINT)
    shell.wait_for("ping average")
    shell.wait_for("^code 0$")
