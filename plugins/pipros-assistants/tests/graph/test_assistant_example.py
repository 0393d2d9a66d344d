"""`pipros mcp` as a user tries it, with a scripted client: what stands in docs/guides/assistants.md."""

import base64
import re
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from tests.graph.test_assistant_command import over_stdio
from tests.support.assistants import call, run
from tests.support.bags import bag_bytes, some_rows
from tests.support.environments import REPOSITORY
from tests.support.ros import RosSystem

LaserScan: Any = load_message_class("sensor_msgs/LaserScan")
PAGE = (REPOSITORY / "plugins" / "pipros-assistants" / "docs" / "guides" / "assistants.md").read_text(
    encoding="utf-8"
)
[DRIVE] = re.findall(r'^```yaml title="drive\.yaml"\n(.*?)^```', PAGE, re.MULTILINE | re.DOTALL)
APPROVE, EXAMPLE = re.findall(r"^```console\n\$ (.*?)\n", PAGE, re.MULTILINE)


def test_a_robot_drives_to_a_pose_with_one_approval(ros: RosSystem) -> None:
    (ros.home / "drive.yaml").write_text(DRIVE)
    shutil.copy(REPOSITORY / "examples" / "assistant" / "drive_to_pose.py", ros.home)
    human = ros.pipros.open_terminal()
    human.type(APPROVE)
    human.wait_for("Waiting for acts")
    client = ros.pipros.start(*EXAMPLE.replace("python3", sys.executable, 1).split())
    human.wait_for(r"n: refuse > ")
    shown = human.output
    for expected in (
        "tool    publish\n", "name    /cmd_vel\n", '"angular": {"x": 0.0, "y": 0.0, "z": -0.8}',
        "rule    drive.yaml:2: topics./cmd_vel, at most 600 a minute, stopped after 0.5 s\n",
        "master  http://localhost:", " s left. ",
    ):  # fmt: skip
        assert expected in shown
    human.answer("m")
    human.wait_for("Answered: minute.")
    assert client.wait(120) == 0
    places = re.findall(r"at \((.*), (.*)\), (.*) m to go", client.output)
    assert float(places[-1][2]) < 0.1
    assert len(places) > 2
    assert "n: refuse" not in human.output.partition("Answered")[2], "one approval was enough"
    human.press_ctrl_c()
    assert human.wait_for_prompt() == 130


def test_an_act_that_a_human_refuses_does_not_happen(ros: RosSystem) -> None:
    (ros.home / "drive.yaml").write_text(DRIVE)
    shutil.copy(REPOSITORY / "examples" / "assistant" / "drive_to_pose.py", ros.home)
    human = ros.pipros.open_terminal()
    human.type(APPROVE)
    client = ros.pipros.start(*EXAMPLE.replace("python3", sys.executable, 1).split())
    human.wait_for(r"n: refuse > ")
    human.answer("n")
    assert client.wait(120) == 1
    client.wait_for("this act is refused; data has the reason: a human has refused this")
    assert client.output.count(" m to go") == 1


@pytest.fixture
def home(ros: RosSystem) -> Path:
    ros.serve_master()
    bags = ros.home / "bags"
    bags.mkdir()
    (bags / "run.bag").write_bytes(bag_bytes(some_rows()))
    return ros.home


def test_a_client_finds_why_a_topic_is_silent_and_plots_from_a_bag(ros: RosSystem, home: Path) -> None:
    del home

    async def look(client: Any) -> tuple[str, bytes]:
        topics = {row["topic"]: row for row in (await call(client, "list_topics")).data}
        [silent] = [name for name, row in topics.items() if row["subscribers"] and not row["publishers"]]
        rows = (await call(client, "why_no_data", topic=silent, wait_s=0.3)).data
        [bag] = (await call(client, "list_bags")).data
        numbers = [
            row["topic"]
            for row in (await call(client, "describe_bag", bag=bag)).data
            if row.get("type") == "std_msgs/Int32"
        ]
        plot = await call(client, "plot_bag", bag=bag, topic=numbers[0], parts=["data"])
        return rows[-1]["summary"], base64.b64decode(plot.pictures[0].data)

    environment = Environment(master_uri=ros.master_uri)
    with Node("planner", environment=environment) as planner, Node("lidar", environment=environment) as lidar:
        planner.subscribe("/scan", LaserScan, print)
        lidar.advertise("/front/scan", LaserScan)
        why, picture = run(over_stdio(ros), look)
    assert "/front/scan" in why
    assert picture.startswith(b"\x89PNG")


def test_approve_needs_a_terminal_and_takes_no_options(ros: RosSystem) -> None:
    ended = ros.pipros.run("pipros", "mcp", "approve")
    assert ended.returncode == 1
    assert ended.stderr == ["ERROR: pipros mcp approve must run in a terminal, because a human must answer"]
    assert ros.pipros.run("pipros", "mcp", "approve", "--http", "0").returncode == 2


def test_a_policy_that_is_wrong_ends_the_command(ros: RosSystem) -> None:
    (ros.home / "p.yaml").write_text("topics: {/x: {}}\n")
    ended = ros.pipros.run("pipros", "mcp", "--policy", "p.yaml")
    assert ended.returncode == 1
    assert "topics./x.type: is missing" in ended.stderr[-1]
