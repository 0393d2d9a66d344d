"""The nodelets of Kobuki's launch files: a multiplexer of velocities, and the safety controller."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

Twist: Any = load_message_class("geometry_msgs/Twist")
String: Any = load_message_class("std_msgs/String")
Empty: Any = load_message_class("std_msgs/Empty")

LAUNCH = """<launch>
  <node pkg="nodelet" type="nodelet" name="mobile_base_nodelet_manager" args="manager"/>
  <include file="$(find yocs_cmd_vel_mux)/launch/cmd_vel_mux.launch">
    <arg name="nodelet_manager_name" value="mobile_base_nodelet_manager"/>
  </include>
  <include file="$(find kobuki_safety_controller)/launch/safety_controller.launch"/>
  <param name="kobuki_safety_controller/time_to_extend_bump_cliff_events" value="0.3"/>
</launch>
"""
NEW = "subscribers: [{name: Other, topic: /other, timeout: 5.0, priority: 1}]\npublisher: output/cmd_vel"


@pytest.fixture
def robot(ros: RosSystem) -> Iterator[Node]:
    ros.serve_master()
    with Node("robot", environment=Environment(master_uri=ros.master_uri)) as node:
        yield node


def repeated(publish: Callable[[], object], is_there: Callable[[], bool]) -> None:
    """Publish until a condition is true."""

    def sent() -> bool:
        publish()
        return is_there()

    wait_until(sent, 30)


def event(kind: str, **fields: int) -> Any:
    return load_message_class(f"kobuki_msgs/{kind}")(**fields)


def test_the_safety_controller_takes_over_from_navigation_and_gives_back(ros: RosSystem, robot: Node) -> None:
    (ros.home / "kobuki.launch").write_text(LAUNCH)
    launch = ros.pipros.start("roslaunch", "kobuki.launch")
    commands, active = Inbox(), Inbox()
    robot.subscribe("/cmd_vel_mux/output/cmd_vel", Twist, commands)
    robot.subscribe("/cmd_vel_mux/active", String, active)
    navigation = robot.advertise("/cmd_vel_mux/input/navigation", Twist, queue_size=1)
    bumper = robot.advertise("/mobile_base/events/bumper", type(event("BumperEvent")), queue_size=5)
    wheel = robot.advertise("/mobile_base/events/wheel_drop", type(event("WheelDropEvent")), queue_size=5)
    switches = [
        robot.advertise(f"/kobuki_safety_controller/{name}", Empty, queue_size=5)
        for name in ("disable", "enable", "reset")
    ]
    for each in (navigation, bumper, wheel, *switches):
        wait_until_connected(each)
    forward = Twist()
    forward.linear.x = 0.3

    def drives(v: float, w: float) -> bool:
        navigation.publish(forward)
        newest = commands.messages[-1] if commands.messages else Twist()
        return (newest.linear.x, newest.angular.z) == (v, w)

    wait_until(lambda: drives(0.3, 0.0), 30)
    bumper.publish(event("BumperEvent", bumper=0, state=1))
    wait_until(lambda: drives(-0.1, -0.4), 30)
    wheel.publish(event("WheelDropEvent", wheel=1, state=1))
    wait_until(lambda: drives(0.0, 0.0), 30)
    wheel.publish(event("WheelDropEvent", wheel=1, state=0))
    wait_until(lambda: drives(-0.1, -0.4), 30)
    disable, enable, reset = switches
    disable.publish(Empty())
    wait_until(lambda: drives(0.3, 0.0), 30)
    enable.publish(Empty())
    wait_until(lambda: drives(-0.1, -0.4), 30)
    reset.publish(Empty())
    wait_until(lambda: drives(0.3, 0.0), 30)
    wait_until(lambda: commands.messages[-1] == Twist() and active.messages[-1].data == "idle", 30)
    names = [each.data for each in active.messages]
    assert names[:3] == ["idle", "Navigation", "Safety controller"]
    launch.press_ctrl_c()
    launch.wait()


def test_a_mux_is_reconfigured_while_it_runs(ros: RosSystem, robot: Node) -> None:
    node = ros.pipros.start(
        "rosrun", "nodelet", "nodelet", "standalone", "yocs_cmd_vel_mux/CmdVelMuxNodelet", "__name:=mux"
    )
    node.wait_for(r"invalid configuration \(~yaml_cfg_file is \[\]\): .*No such file")
    commands, active = Inbox(), Inbox()
    robot.subscribe("/mux/output/cmd_vel", Twist, commands)
    robot.subscribe("/mux/active", String, active)
    service: Any = load_service_class("dynamic_reconfigure/Reconfigure")
    client = robot.client("/mux/set_parameters", service)
    assert client.wait_until_available(60, pause=robot.clock.sleep, report=print)
    text: Any = load_message_class("dynamic_reconfigure/StrParameter")

    def configure(data: str) -> None:
        request = service._request_class()
        request.config.strs = [text("yaml_cfg_data", data)]
        client.call(request, 60)

    configure(NEW)
    other = robot.advertise("/other", Twist, queue_size=1)
    forward = Twist()
    forward.linear.x = 0.2
    repeated(lambda: other.publish(forward), lambda: forward in commands.messages)
    configure("subscribers: []")
    node.wait_for("`subscribers` has no valid source")
    commands.messages.clear()
    repeated(lambda: other.publish(forward), lambda: forward in commands.messages)
    configure(NEW.replace("/other", "/another"))
    wait_until(lambda: commands.messages[-1] == Twist(), 30)
    wait_until(lambda: [each.data for each in active.messages] == ["idle", "Other", "idle"], 30)
    node.press_ctrl_c()
    assert node.wait() == 0
