"""The diagnostic aggregator as a node: parameters, topics, and analyzers added by another node."""

from __future__ import annotations

from typing import Any

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

DiagnosticArray: Any = load_message_class("diagnostic_msgs/DiagnosticArray")
DiagnosticStatus: Any = load_message_class("diagnostic_msgs/DiagnosticStatus")
LAUNCH = """<launch>
  <node pkg="diagnostic_aggregator" type="aggregator_node" name="aggregator" output="screen">
    <param name="pub_rate" value="50"/>
    <rosparam>
      analyzers:
        good: {type: diagnostic_aggregator/GenericAnalyzer, path: Good, startswith: good, timeout: 0}
        bad: {type: my_pkg/MyAnalyzer, path: Bad}
    </rosparam>
  </node>
</launch>"""


def test_an_aggregator_accepts_analyzers_of_other_nodes(ros: RosSystem) -> None:
    ros.serve_master()
    launch = ros.home / "aggregator.launch"
    launch.write_text(LAUNCH)
    launched = ros.pipros.start("roslaunch", launch)
    states: list[int] = []
    reports: list[dict[str, Any]] = [{}]

    def keep(array: Any) -> None:
        reports.append({status.name: status for status in array.status})

    with Node("probe", environment=Environment(master_uri=ros.master_uri)) as node:
        node.subscribe("/diagnostics_agg", DiagnosticArray, keep)
        node.subscribe(
            "/diagnostics_toplevel_state", DiagnosticStatus, lambda state: states.append(state.level)
        )
        publisher = node.advertise("/diagnostics", DiagnosticArray, latch=True)
        array = DiagnosticArray(
            status=[DiagnosticStatus(0, name, "m", "hw", []) for name in ("good: 1", "lent")]
        )
        array.header.stamp.secs = 1

        def report_of(*names: str) -> dict[str, Any]:
            publisher.publish(array)
            newest = reports[-1]
            return newest if set(newest) == set(names) else {}

        before = ["/Good", "/Good/good: 1", "/bad", "/Other", "/Other/lent"]
        report = wait_until(lambda: report_of(*before), 60, lambda: f"{list(reports[-1])} {launched.output}")
        good, bad = report["/Good/good: 1"], report["/bad"]
        assert (good.level, good.message, good.hardware_id) == (0, "m", "hw")
        assert (bad.level, bad.message) == (2, "Pluginlib exception loading analyzer")
        assert bad.values[0].value.startswith("unknown analyzer type my_pkg/MyAnalyzer")
        wait_until(lambda: states and states[-1] == 2, 60, "the level of everything")
        launched.wait_for("the analyzer /bad is ignored")

        told = ros.pipros.run("rosrun", "rosdiagnostic", "rosdiagnostic", "-l", "warning", "-d")
        assert told.returncode == 0, told.output
        assert "Error    /bad: Pluginlib exception loading analyzer" in told.stdout
        assert any("unknown analyzer type my_pkg/MyAnalyzer" in line for line in told.stdout)
        assert not any("/Good" in line for line in told.stdout)
        told = ros.pipros.run("rosrun", "rosdiagnostic", "rosdiagnostic", "-t", "/nothing", "-w", "0.1")
        assert (told.returncode, "no message on /nothing within 0.1 s" in told.output) == (1, True)

        node.master.set_param(
            "/lender/analyzers", {"a": {"type": "GenericAnalyzer", "path": "L", "name": "lent"}}
        )
        file = ros.home / "analyzers.yaml"
        file.write_text("analyzers: {a: {type: GenericAnalyzer, path: F, name: lent}}\n")
        of_file = ros.pipros.start("rosrun", "diagnostic_aggregator", "add_analyzers", file, "-t", "30")
        wait_until(
            lambda: report_of("/Good", "/Good/good: 1", "/bad", "/F", "/F/lent"), 60, lambda: str(reports[-1])
        )
        assert node.master.has_param("/add_analyzers/analyzers/a/type")
        of_file.press_ctrl_c()
        assert of_file.wait() == 0
        wait_until(lambda: report_of(*before), 60, lambda: str(reports[-1]))

        lender = ros.pipros.start("rosrun", "diagnostic_aggregator", "add_analyzers", "__name:=lender")
        lender.wait_for("the analyzers were added")
        lent = ("/Good", "/Good/good: 1", "/bad", "/L", "/L/lent")
        wait_until(lambda: report_of(*lent), 60, lambda: str(reports[-1]))
        lender.press_ctrl_c()
        assert lender.wait() == 0
        wait_until(lambda: report_of(*before), 60, lambda: f"{list(reports[-1])} {launched.output}")

        refused = ros.pipros.run("rosrun", "diagnostic_aggregator", "add_analyzers", "__name:=poor")
        assert (refused.returncode, "/poor/analyzers is not set" in refused.output) == (1, True)
        node.master.set_param("/wrong/analyzers", {"a": {"type": "my_pkg/MyAnalyzer", "path": "L"}})
        refused = ros.pipros.run("rosrun", "diagnostic_aggregator", "add_analyzers", "__name:=wrong")
        assert (refused.returncode, "unknown analyzer type my_pkg" in refused.output) == (1, True)
