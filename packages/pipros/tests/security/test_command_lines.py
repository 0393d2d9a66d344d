"""No token and no code is in a command line, which every user of the machine can read."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


def command_lines() -> str:
    found = []
    for process in Path("/proc").iterdir():
        if process.name.isdigit():
            try:
                found.append((process / "cmdline").read_bytes().replace(b"\0", b" "))
            except OSError:  # it has ended
                continue
    return os.fsdecode(b"\n".join(found))


@pytest.mark.parametrize("command", ["rqt_graph", "rviz", "rosrun turtlesim turtlesim_node"])
def test_the_browser_of_a_command_gets_no_secret_in_its_command_line(
    ros: RosSystem, tmp_path: Path, command: str
) -> None:
    opened, browser = tmp_path / "opened", tmp_path / "browser"
    copies = f'cp "${{1#file://}}" {opened}.part\nmv {opened}.part {opened}'
    browser.write_text(f"#!/bin/sh\n{copies}\nread line <{tmp_path}/fifo\n")
    browser.chmod(0o700)
    os.mkfifo(tmp_path / "fifo")  # the browser runs until it is killed
    ros.pipros.start_master()
    ros.pipros.environment.update(BROWSER=f"{browser} %s", DISPLAY=":0", HOME=str(ros.home))
    program = ros.pipros.start(*command.split())
    token = program.wait_for(r"#token=([\w-]+)")[1]
    wait_until(opened.exists, 60, lambda: program.output)

    seen = command_lines()

    code = re.search(r"#code=([\w-]+)", opened.read_text())
    assert code is not None
    assert "/pipros-page-" in seen, "the browser has ended"
    assert code[1] not in seen
    assert token not in seen
    program.wait_for(f"paste this address into one: http://localhost:\\d+/#token={token}")
