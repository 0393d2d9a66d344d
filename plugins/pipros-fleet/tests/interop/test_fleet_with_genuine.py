"""Two robots with genuine masters and genuine nodes, and genuine nodes at an operator's master of pipros."""

import json
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from pipros_fleet import keys
from pipros_fleet.zenoh_connecting import open_router
from tests.chaos.test_fleet_links import cable_to
from tests.support.environments import file_of_tests
from tests.support.fleet import LIMIT_S, Member, running_router
from tests.support.ports import ClaimedPort
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PYTHON = "/usr/bin/python3"
ACCEPTS = """
share: {parameters: [/robot/speed]}
accept: {topics: [{name: /cmd, from: [operator]}, /do/goal, /do/cancel], services: [/lamp]}
"""


@pytest.fixture
def robots(tmp_path: Path, bare_tools: Path) -> Iterator[dict[str, RosSystem]]:
    with ExitStack() as stack:
        found = {}
        for name in ("robot1", "robot2"):
            port = ClaimedPort()
            stack.callback(port.release)
            (tmp_path / name).mkdir()
            found[name] = RosSystem(port.number, tmp_path / name, bare_tools)
            stack.callback(found[name].close)
        yield found


@pytest.mark.timeout(300)
def test_an_operator_uses_two_genuine_robots(plain_ros: RosSystem, robots: dict[str, RosSystem]) -> None:
    plain_ros.serve_master()
    port = ClaimedPort()
    with ExitStack() as stack:
        stack.callback(port.release)
        router = stack.enter_context(running_router(port.number))
        for name, robot in robots.items():
            robot.genuine.start_bare_master()
            robot.genuine.start(PYTHON, file_of_tests("interop/programs/fleet_robot.py"), name).wait_for(
                "ready"
            )
            stack.enter_context(Member(name, router, ACCEPTS, master_uri=robot.master_uri))
        member = stack.enter_context(Member("operator", router, master_uri=plain_ros.master_uri))
        operator = plain_ros.genuine.start(PYTHON, file_of_tests("interop/programs/fleet_operator.py"))
        operator.wait_for("done", 120)
        lines = [line for line in operator.stdout if line.startswith("robot")]
        expected = [
            line
            for name in robots
            for line in (
                f"{name} chatter", f"{name} latched map of {name}", f"{name} legal legal",
                f"{name} static ['laser']", f"{name} service {name}", f"{name} error True",
                f"{name} action 42", f"{name} command {name} got go",
            )
        ]  # fmt: skip
        assert lines == expected

        for name in robots:
            key = keys.parameters(name, "get", "operator")
            (answer,) = member.link.get(key, json.dumps("/robot/speed").encode(), timeout_s=60)
            assert json.loads(answer.payload) == 1.5

        plain_ros.genuine.start("rostopic", "pub", "/robot1/cmd", "std_msgs/Int32", "5")
        subscribe = "from std_msgs.msg import Int32; rospy.Subscriber('/robot1/number', Int32, print)"
        plain_ros.genuine.start(
            PYTHON, "-c", f"import rospy; rospy.init_node('wrong'); {subscribe}; rospy.spin()"
        )
        for expected_text in (
            "Client [/wrong] wants topic [/robot1/number] to have datatype/md5sum [std_msgs/Int32/",
            "topic types do not match: [std_msgs/String] vs. [std_msgs/Int32]",
        ):
            wait_until(
                lambda text=expected_text: any(text in each for each in member.warnings),  # type: ignore[misc]
                60,
                expected_text,
            )


def wait_for_more(echo: Process) -> None:
    before = len(echo.stdout)
    wait_until(lambda: len(echo.stdout) > before + 5, LIMIT_S, lambda: f"{echo} prints no more")


@pytest.mark.timeout(400)
def test_genuine_nodes_receive_again_after_a_cut_and_after_kills(
    plain_ros: RosSystem, robots: dict[str, RosSystem]
) -> None:
    """The robot's cable is pulled, the router is replaced, and the robot is killed and started again."""
    plain_ros.serve_master()
    robot = robots["robot1"]
    robot.genuine.start_bare_master()
    port = ClaimedPort()
    address = f"tcp/127.0.0.1:{port.number}"
    with ExitStack() as stack:
        stack.callback(port.release)
        routers = [open_router([address])]
        stack.callback(lambda: routers[-1].close())
        cable = stack.enter_context(cable_to(port.number))
        operator = stack.enter_context(Member("operator", address, master_uri=plain_ros.master_uri))
        join = ("pipros", "fleet", "join", "robot1", "--router", cable.address)
        talk = ("rostopic", "pub", "-r", "20", "/chatter", "std_msgs/String", "beat")
        agent, talker = robot.pipros.start(*join), robot.genuine.start(*talk)
        near = robot.genuine.start("rostopic", "echo", "/chatter")
        operator.wait_for_topic("/robot1/chatter")
        far = plain_ros.genuine.start("rostopic", "echo", "/robot1/chatter")
        wait_for_more(far)

        cable.stall()
        wait_until(
            lambda: "robot1" not in operator.agent.statistics()["members"], LIMIT_S, "the robot to be missed"
        )
        wait_for_more(near)
        cable.stall(stall=False)
        cable.cut()
        wait_for_more(far)

        routers[-1].close()
        wait_until(lambda: not operator.agent.sender.is_up, LIMIT_S, "the operator to notice")
        wait_for_more(near)
        routers.append(open_router([address]))
        wait_for_more(far)

        agent.kill()
        talker.kill()
        wait_until(lambda: not plain_ros.publishers("/robot1/chatter"), LIMIT_S, "the topic to go")
        robot.pipros.start(*join)
        robot.genuine.start(*talk)
        wait_for_more(far)
