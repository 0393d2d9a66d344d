"""`pipros policy check`: the examples of docs/guides/policy.md, and a bag tested with that of turtlesim."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest

import rosbag
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros_tools.cli.policy import main
from tests.support import documents

DOCUMENT = documents.text_of("guides/policy.md")
FILES = dict(re.findall(r'^```yaml title="(\w+\.yaml)"\n(.*?)^```', DOCUMENT, re.MULTILINE | re.DOTALL))
TYPED = re.findall(r"^```console\n\$ (.*?)\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change to a folder with the examples."""
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", ["base.yaml", "turtle.yaml", "arm.yaml"])
def test_the_examples_of_the_documentation_are_valid(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", name]) == 0
    assert capsys.readouterr().out.endswith("Clients may do nothing else.\n")


def test_the_documentation_shows_what_the_command_prints(capsys: pytest.CaptureFixture[str]) -> None:
    assert TYPED
    for line, expected in TYPED:
        assert (main(shlex.split(line)[2:]), capsys.readouterr().out) == (0, expected)


def test_the_names_of_all_units_are_in_the_documentation() -> None:
    from pipros_server.policy.field_file import UNITS

    (row,) = [line for line in DOCUMENT.splitlines() if line.startswith("| `unit`")]
    assert {each for each in UNITS if each} <= set(re.findall(r"`([^`]+)`", row))


def test_an_invalid_file_is_an_error_with_its_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "bad.yaml").write_text("topics:\n  /x: {typ: std_msgs/String}\n")
    assert main(["check", "bad.yaml"]) == 1
    assert "bad.yaml:2: topics./x.typ: unknown key. Did you mean type?" in capsys.readouterr().err


def write_bag(path: Path, speeds: list[float]) -> None:
    twist: Any = load_message_class("geometry_msgs/Twist")
    with rosbag.Bag(path, "w") as bag:
        for number, speed in enumerate(speeds):
            message = twist()
            message.linear.x = speed
            bag.write("/turtle1/cmd_vel", message, Time(100 + number))
            bag.write("/other", message, Time(100 + number))


def test_a_bag_shows_what_passes_and_the_first_message_that_each_rule_refuses(folder: Path, capsys) -> None:
    write_bag(folder / "drive.bag", [0.0, 1.0, 2.5, 3.0, 2.0])
    assert main(["check", "turtle.yaml", "--bag", "drive.bag"]) == 1
    rule = "turtle.yaml:5: topics./turtle1/cmd_vel.fields.linear.x"
    assert capsys.readouterr().out.partition("nothing else.\n")[2] == (
        "\n5 messages on topics of the policy: 3 pass, 2 are refused.\n"
        f"  2 by {rule}, the first one 2.000 s after the start:\n"
        f"    linear.x of /turtle1/cmd_vel must be from 0 to 2 m/s, got 2.5 m/s ({rule})\n"
        "5 messages on topics that the policy does not name were not tested: /other\n"
    )


def test_a_bag_that_the_policy_allows_is_a_success(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_bag(folder / "drive.bag", [0.0, 1.0])
    assert main(["check", "turtle.yaml", "--bag", "drive.bag"]) == 0
    assert "2 messages on topics of the policy: 2 pass, 0 are refused." in capsys.readouterr().out


def test_conditions_are_read_from_the_bag(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    twist, joy = load_message_class("geometry_msgs/Twist"), load_message_class("sensor_msgs/Joy")
    (folder / "p.yaml").write_text(
        "topics: {/cmd_vel: {type: geometry_msgs/Twist, fields: any, requires: held}}\n"
        "conditions:\n"
        "  held: {topic: /joy, type: sensor_msgs/Joy, field: 'buttons[0]', one_of: [1], max_age_s: 1}\n"
    )
    with rosbag.Bag(folder / "drive.bag", "w") as bag:
        bag.write("/cmd_vel", twist(), Time(100))
        bag.write("/joy", joy(buttons=[1]), Time(101))
        bag.write("/cmd_vel", twist(), Time(102))
        bag.write("/cmd_vel", twist(), Time(103))
    assert main(["check", "p.yaml", "--bag", "drive.bag"]) == 1
    out = capsys.readouterr().out
    assert "3 messages on topics of the policy: 1 pass, 2 are refused." in out
    assert "the condition held does not hold: no message on /joy yet" in out
