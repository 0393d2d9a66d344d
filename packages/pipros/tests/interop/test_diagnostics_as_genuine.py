"""diagnostic_updater of both sides publishes the same reports."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros.msg.time import Time
from rosbag import Bag
from tests.interop.programs.examine_diagnostics import __file__ as script
from tests.support.ros import RosSystem

PROGRAMS = Path(__file__).parent / "programs"


def asked(python: str) -> Any:
    ended = subprocess.run(
        [python, script, "1", "200"],
        env={"PATH": "/usr/bin:/bin"},
        check=True,
        capture_output=True,
        text=True,
    )
    return json.loads(ended.stdout)


def test_tasks_report_alike_on_random_events() -> None:
    assert asked(sys.executable) == asked("/usr/bin/python3")


def test_recorded_diagnostics_are_exported_alike(plain_ros: RosSystem) -> None:
    array, status, pair = (
        load_message_class(f"diagnostic_msgs/{name}")
        for name in ("DiagnosticArray", "DiagnosticStatus", "KeyValue")
    )
    bag = plain_ros.home / "robot.bag"
    with Bag(str(bag), "w") as file:
        for second in range(5):
            later = [pair("later", "1")] if second > 2 else []
            message = array(
                status=[
                    status(
                        second % 4, "Motor (left): a/b", " hot, very", "hw,1", [pair("x", "a\nb,c"), *later]
                    ),
                    status(0, "Fan.1", "", "", [pair("Temp, C", str(second))]),
                ]
            )
            message.header.stamp.secs = 1_700_000_000 + second
            file.write("/diagnostics", message, Time(1_700_000_100 + second))
            file.write("/other_diagnostics", message, Time(1_700_000_100 + second))

    written = {}
    for side in ("genuine", "pipros"):
        runner = getattr(plain_ros, side)
        program = ["rosrun", "diagnostic_analysis", "export_csv.py"]
        if side == "genuine":  # its first line names a Python that does not exist
            program = ["python3", "/usr/lib/diagnostic_analysis/export_csv.py"]
        ended = runner.run(*program, "-d", side, bag)
        assert "Processing file robot.bag. File 1 of 1." in ended.stdout, ended.output
        folder = plain_ros.home / side
        written[side] = {
            str(file.relative_to(folder)): file.read_text() for file in folder.rglob("*") if file.is_file()
        }

    assert written["pipros"] == written["genuine"], ended.output
    assert len(written["pipros"]) == 2
    missing = plain_ros.pipros.run("rosrun", "diagnostic_analysis", "export_csv.py", "nothing.bag")
    assert (missing.returncode, "ERROR: nothing.bag: " in missing.output) == (1, True)


@pytest.mark.timeout(200)
def test_a_node_sends_the_same_reports(plain_ros: RosSystem) -> None:
    plain_ros.serve_master()
    program = PROGRAMS / "report_diagnostics.py"

    genuine = plain_ros.genuine.run("python3", program, timeout_s=60)
    ours = plain_ros.pipros.run("python3", program, timeout_s=60)

    assert ours.stdout == genuine.stdout, ours.output
    assert len(ours.stdout) == 9


@pytest.mark.parametrize("arguments", [[], ["-l", "7"], ["--max"], ["-l", "1000"]])
def test_sparse_csv_keeps_the_rows_that_genuine_keeps(plain_ros: RosSystem, arguments: list[str]) -> None:
    rows = [f'{number},"a, ""b""",{number * 0.5}' for number in range(95)]
    written = {}
    for side in ("genuine", "pipros"):
        folder = plain_ros.home / side
        folder.mkdir()
        file = folder / "log.csv"
        file.write_text("\n".join(["time,text,value", *rows]) + "\n")
        program = ["rosrun", "diagnostic_analysis", "sparse_csv.py"]
        if side == "genuine":
            program = ["python3", "/usr/lib/diagnostic_analysis/sparse_csv.py"]
        ended = getattr(plain_ros, side).run(*program, *arguments, str(file))
        assert ended.returncode == 0, ended.output
        (made,) = set(folder.iterdir()) - {file}
        assert ended.stdout[-1] == f"Created sparse CSV {made}"
        written[side] = made.name, made.read_bytes()
    assert written["pipros"] == written["genuine"]


def test_sparse_csv_names_what_it_cannot_read(plain_ros: RosSystem) -> None:
    program = ("rosrun", "diagnostic_analysis", "sparse_csv.py")
    missing = plain_ros.pipros.run(*program, "nothing.csv")
    assert (missing.returncode, "nothing.csv" in missing.output) == (1, True)
    assert plain_ros.pipros.run(*program, "log.txt").stdout == ["File log.txt is not a CSV file. Aborting."]
    assert "skip must be >= 1, got 0" in plain_ros.pipros.run(*program, "-s", "0", "log.csv").output
