"""`pipros stubs --watch` keeps stubs current while definitions are edited."""

from __future__ import annotations

import signal
from pathlib import Path

from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

MANIFEST = "<package><name>robot</name><version>1.0.0</version></package>"


def test_stubs_follow_the_definitions_past_a_mistake(ros: RosSystem, tmp_path: Path) -> None:
    messages = tmp_path / "robot" / "msg"
    messages.mkdir(parents=True)
    (messages.parent / "package.xml").write_text(MANIFEST)
    (messages / "Battery.msg").write_text("int32 level\n")
    folder = tmp_path / "typings"
    stub = folder / "robot/msg/__init__.pyi"
    watcher = ros.pipros.start(
        "pipros", "stubs", "--watch", "robot", "-o", str(folder), ROS_PACKAGE_PATH=str(tmp_path)
    )
    watcher.wait_for("msg/__init__.pyi")
    assert "level: int" in stub.read_text()

    (messages / "Battery.msg").write_text("int32\n")
    watcher.wait_for("Battery.msg:1")
    assert "level: int" in stub.read_text()
    (messages / "Battery.msg").write_text("string name\n")
    wait_until(lambda: "name: str" in stub.read_text())
    (messages / "Motor.msg").write_text("float64 current\n")
    wait_until(lambda: "class Motor" in stub.read_text())

    watcher.send_signal(signal.SIGINT)
    assert watcher.wait() == 0
