"""`from composiv_tryouts.msg import BatteryLevel` works without a build in every kind of script."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.environments import EXAMPLES
from tests.support.ros import RosSystem
from tests.tutorial.words import HEARD, SAID

SCRIPTS = EXAMPLES / "composiv_tryouts" / "scripts"


@pytest.mark.parametrize(
    "lines",
    [
        "from composiv_tryouts.msg import BatteryLevel",
        "import composiv_tryouts.msg; BatteryLevel = composiv_tryouts.msg.BatteryLevel",
        "import rospy; from composiv_tryouts.msg import BatteryLevel",
        "from composiv_tryouts.msg import *",
    ],
)
def test_a_message_can_be_imported_on_the_first_line_of_a_script(ros: RosSystem, lines: str) -> None:
    script = ros.home / "script.py"
    script.write_text(f"{lines}\nprint(BatteryLevel._md5sum, BatteryLevel(battery='%25'))\n")

    ended = ros.pipros.run("python3", script)

    assert ended.stdout == ['cb6d55cbf4a366bc603a59ea79320b82 battery: "%25"'], ended.output


def test_plain_python_runs_the_nodes_too(ros: RosSystem) -> None:
    ros.pipros.start_master()

    ros.pipros.start("python3", SCRIPTS / "composiv_talker.py").wait_for(SAID)
    ros.pipros.start("python3", SCRIPTS / "composiv_listener.py").wait_for(HEARD)


def test_nothing_is_written_into_the_package(ros: RosSystem, own_copy: Path) -> None:
    before = sorted(own_copy.rglob("*"))

    ended = ros.pipros.run("rostest", "composiv_tryouts", "composiv_tryout.launch")

    assert ended.returncode == 0, ended.output
    assert sorted(own_copy.rglob("*")) == before


def test_a_changed_definition_is_seen_at_the_next_start(ros: RosSystem, own_copy: Path) -> None:
    command = ("python3", "-c", "from composiv_tryouts.msg import BatteryLevel as B; print(B.__slots__)")
    assert ros.pipros.run(*command).stdout == ["['battery']"]

    (own_copy / "msg" / "BatteryLevel.msg").write_text("string battery\nuint8 percent\n")

    assert ros.pipros.run(*command).stdout == ["['battery', 'percent']"]


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("string", "BatteryLevel.msg:1"),
        ("string battery\nstrin g\n", "BatteryLevel.msg:2"),
        ("a/b/c d", ":1"),
    ],
)
def test_a_definition_with_an_error_is_reported_with_its_line(
    ros: RosSystem, own_copy: Path, text: str, named: str
) -> None:
    (own_copy / "msg" / "BatteryLevel.msg").write_text(text)

    ended = ros.pipros.run("python3", "-c", "from composiv_tryouts.msg import BatteryLevel")

    assert ended.returncode == 1
    assert named in ended.stderr[-1] + "\n".join(ended.stderr[-4:])


def test_importing_an_unknown_message_raises_an_import_error_with_the_known_ones(ros: RosSystem) -> None:
    ended = ros.pipros.run("python3", "-c", "from composiv_tryouts.msg import BatteryLevell")

    assert ended.returncode == 1
    assert "ImportError" in ended.stderr[-1]
    assert "BatteryLevell" in ended.stderr[-1]
