"""Benchmarks run, and print the figures of pipros and genuine ROS side by side."""

from __future__ import annotations

import re
from pathlib import Path

from tests.support.environments import REPOSITORY, VENV_BIN
from tests.support.processes import Processes


def test_start_up_times_are_printed_side_by_side(processes: Processes) -> None:
    benchmark = REPOSITORY / "benchmarks" / "startup.py"

    ended = processes.run(
        VENV_BIN / "python", benchmark, "--rounds", "1", "--only", "rostopic,import", timeout_s=120
    )

    assert ended.returncode == 0, ended.output
    assert re.search(r"an (editable|ordinary) install", ended.stdout[0])
    assert re.search(r"pipros +genuine +ratio$", ended.stdout[1])
    for what in ("rostopic list", "rosnode list", "import rospy"):
        assert re.search(rf"(?m)^{what} +\d+\.\d+ +\d+\.\d+ +\d+\.\d+x$", ended.output), ended.output


def test_the_libraries_are_measured_side_by_side(processes: Processes) -> None:
    benchmark = REPOSITORY / "benchmarks" / "libraries.py"

    ended = processes.run(VENV_BIN / "python", benchmark, "--rounds", "1", "--seconds", "0.2", timeout_s=120)

    assert ended.returncode == 0, ended.output
    for what in ("set_transform", "listener, ", "exact, ", "send_goal_and_wait, two", "import tf2_ros"):
        columns = r"( \| [\d.,e+]+){2} \| \d+\.\d+ x \| [\d.]+\.\.[\d.]+ \|$"
        assert re.search(rf"(?m)^\| {what}.*{columns}", ended.output), ended.output


def test_one_table_joins_the_benchmarks_and_replaces_the_one_of_a_document(
    processes: Processes, tmp_path: Path
) -> None:
    document = tmp_path / "performance.md"
    document.write_text("before\n<!-- script/bench begin -->\nold\n<!-- script/bench end -->\nafter\n")
    everything = REPOSITORY / "benchmarks" / "everything.py"
    words = ("--quick", "--only", "bags,page", "--update", document)

    ended = processes.run(VENV_BIN / "python", everything, *words, timeout_s=120)

    assert ended.returncode == 0, ended.output
    text = document.read_text()
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "old" not in text
    assert re.search(r"(?m)^Foreign load: bags \d+ %\.$", text)
    assert re.search(r"(?m)^\| bag: write String, lz4: us( \| [\d.]+){2} \| [\d.]+ x \| .* \| Python ", text)
