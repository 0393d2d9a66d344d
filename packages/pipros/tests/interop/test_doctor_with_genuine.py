"""`pipros doctor` examines systems of genuine ROS: rospy and roscpp nodes, with a genuine master."""

from __future__ import annotations

import json
from typing import Any
from xmlrpc.client import ServerProxy

from pipros.basics.env import Environment
from pipros_tools.health.examine import uncalled_address
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

NODE = (
    "import rospy, std_msgs.msg as s, std_srvs.srv as v\n"
    "rospy.init_node('python'); p = rospy.Publisher('/chatter', s.String, queue_size=1)\n"
    "rospy.Service('/reset', v.Empty, lambda _: v.EmptyResponse())\n"
    "print('up', flush=True); rospy.spin()\n"
)


def findings(ros: RosSystem) -> list[dict[str, Any]]:
    report: dict[str, Any] = json.loads("\n".join(ros.pipros.run("pipros", "doctor", "--json").stdout))
    assert report["examined"] is not None
    return [found for found in report["findings"] if found["rule"] not in ("mixed-programs", "mixed-paths")]


def named(ros: RosSystem) -> set[tuple[str, ...]]:
    return {(found["rule"], *found["subjects"]) for found in findings(ros)}


def test_a_healthy_genuine_system_is_found_healthy_and_its_faults_are_named(ros: RosSystem) -> None:
    ros.genuine.start_master()
    ros.genuine.start("/usr/bin/python3", "-c", NODE).wait_for("up")
    ros.genuine.start("rostopic", "echo", "/chatter", "__name:=ear")
    ros.genuine.start_node("cpp_battery", "battery_listener", "battery_topic:=/battery_topic")
    ros.genuine.start_node("composiv_tryouts", "composiv_talker.py")
    ros.wait_for_subscriber("/battery_topic")
    ros.wait_for_subscriber("/chatter")
    wait_until(lambda: findings(ros) == [], 60.0, "no findings")

    wrong = ros.genuine.start(
        "rostopic", "pub", "-r", "5", "/chatter", "std_msgs/Int32", "1", "__name:=wrong"
    )
    wait_until(lambda: "/wrong" in ros.publishers("/chatter"), 60.0)
    wait_until(lambda: ("publishers-differ", "/chatter", "/python", "/wrong") in named(ros), 60.0)
    wrong.kill()
    wrong.wait()
    wait_until(lambda: ("ghost-node", "/wrong") in named(ros), 60.0)


def test_a_genuine_master_calls_the_doctor_back_and_keeps_nothing_of_it(ros: RosSystem) -> None:
    ros.genuine.start_master()
    environment = Environment(master_uri=ros.master_uri, ip="127.0.0.1")
    wait_until(lambda: uncalled_address(environment, timeout_s=30.0) == "", what="a call from the master")
    with ServerProxy(ros.master_uri) as master:
        kept = master.getParam("/test", "/"), master.getSystemState("/test")
    assert "pipros_doctor" not in str(kept)
