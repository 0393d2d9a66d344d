"""Benchmarks run, and print the figures of pipros and genuine ROS side by side."""

import re
from pathlib import Path
from xml.etree import ElementTree

from tests.support.environments import VENV_BIN, benchmark
from tests.support.processes import Processes


def test_start_up_times_are_printed_side_by_side(processes: Processes) -> None:
    program = benchmark("startup.py")

    ended = processes.run(
        VENV_BIN / "python", program, "--rounds", "1", "--only", "rostopic,import", timeout_s=120
    )

    assert ended.returncode == 0, ended.output
    for what in ("rostopic list", "rosnode list", "import rospy"):
        assert re.search(rf"(?m)^\| {what}: s( \| [\d.]+){{2}} \| [\d.]+ x \|", ended.output), ended.output


def test_the_libraries_are_measured_side_by_side(processes: Processes) -> None:
    program = benchmark("libraries.py")

    ended = processes.run(VENV_BIN / "python", program, "--rounds", "1", "--seconds", "0.2", timeout_s=120)

    assert ended.returncode == 0, ended.output
    for what in (
        "set_transform", "tf listener, ", "TimeSynchronizer, ", "send_goal_and_wait, two", "import tf2_ros",
    ):  # fmt: skip
        columns = r"( \| [\d.,e+]+){2} \| \d+\.\d+ x \| [\d.]+\.\.[\d.]+ \|$"
        assert re.search(rf"(?m)^\| {what}.*{columns}", ended.output), ended.output


def test_message_codecs_are_measured_side_by_side(processes: Processes) -> None:
    words = ("--rounds", "1", "--only", "String")

    ended = processes.run(VENV_BIN / "python", benchmark("codec.py"), *words, timeout_s=120)

    assert ended.returncode == 0, ended.output
    assert re.search(r"(?m)^\| serialize String 16 B: us( \| [\d.]+){2} \| ", ended.output), ended.output


def test_a_chart_shows_cost_over_scale_side_by_side(processes: Processes, tmp_path: Path) -> None:
    program, chart = benchmark("scale.py"), tmp_path / "scale.svg"
    words = ("--quick", "--rounds", "1", "--seconds", "0.1", "--only", "size,topics", "--svg", chart)

    ended = processes.run(VENV_BIN / "python", program, *words, timeout_s=120)

    assert ended.returncode == 0, ended.output
    for what in ("message of 32 kB at 100 Hz: us", "topics, 10: s until advertised and connected"):
        assert re.search(rf"(?m)^\| {what}.*( \| [\d.,e-]+){{2}} \| \d+\.\d+ x", ended.output), ended.output
    svg = ElementTree.parse(chart).getroot()  # noqa: S314 - written by the run above
    namespace = "{http://www.w3.org/2000/svg}"
    assert "(bytes) from 16 to 32k: genuine " in (svg.findtext(f"{namespace}desc") or "")
    assert [line.get("class") for line in svg.iter(f"{namespace}polyline")] == ["genuine", "pipros"] * 2


def test_one_table_joins_the_benchmarks_and_replaces_the_one_of_a_document(processes, tmp_path) -> None:
    document = tmp_path / "performance.md"
    document.write_text("before\n<!-- script/bench begin -->\nold\n<!-- script/bench end -->\nafter\n")
    everything = benchmark("everything.py")
    words = ("--quick", "--only", "bags,wheels", "--update", document)

    ended = processes.run(VENV_BIN / "python", everything, *words, timeout_s=120)

    assert ended.returncode == 0, ended.output
    text = document.read_text()
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "old" not in text
    assert re.search(r"(?m)^`script/bench bags .*`: commit .*, foreign load (\*\*)?\d+ %(\*\*)?\.$", text)
    assert re.search(
        r"(?m)^\| bag: write String, compression lz4: us( \| [\d.]+){2} \| [\d.]+ x \| .* \| Python ", text
    )
