"""Recorded answers in place of genuine nodes: values, misfits, and which recording belongs to which test."""

import gzip
import hashlib
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import Time
from tests.support.environments import REPOSITORY, TEST_PATH, files_below
from tests.support.recordings import FOLDER, Recording, file_of

Scan: Any = load_message_class("sensor_msgs/LaserScan")
Cloud: Any = load_message_class("sensor_msgs/PointCloud2")
ToLL: Any = load_service_class("robot_localization/ToLL")
SCAN = {"header": {"stamp": [7, 5], "frame_id": "laser"}, "ranges": [math.nan, math.inf, 1.5]}
INPUTS = [
    {"input": "parameters", "value": {"names": ["a", "b"], "limits": [[1.0, 2], [3.0]], "is_on": True}},
    {"input": "publish scan", "type": "sensor_msgs/LaserScan", "md5": Scan._md5sum, "value": SCAN},
]
CALLS = [
    {
        "service": "toLL", "type": "robot_localization/ToLL", "md5": ToLL._md5sum,
        "request": {"map_point": {"x": float(x), "y": 0.0, "z": 0.0}}, "response": response,
    }
    for x, response in ((1, {"ll_point": {"latitude": 52.5}}), (2, None))
]  # fmt: skip

RUN: dict[str, Any] = {"messages": {}, "calls": [], "values": {}, "steps": {}}


def scan(**values: Any) -> Any:
    made = Scan(**values)
    made.header.stamp, made.header.frame_id, made.ranges = Time(7, 5), "laser", [math.nan, math.inf, 1.5]
    return made


def full(values: dict[str, Any]) -> dict[str, Any]:
    """Add the fields of an empty scan."""
    numbers = ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min")
    return {**dict.fromkeys((*numbers, "range_max"), 0.0), "intensities": [], **values}


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    inputs = [INPUTS[0], {**INPUTS[1], "value": full(SCAN)}]
    run = {
        "messages": {"scan": {"type": "sensor_msgs/LaserScan", "md5": Scan._md5sum, "messages": [SCAN]}},
        "calls": CALLS,
        "values": {"files": {"array": "<u1", "shape": [2], "base64": "AQI="}},
        "steps": {"places": [[1], [2]]},
    }
    file = tmp_path / "test.json.gz"
    file.write_bytes(gzip.compress(json.dumps({"inputs": inputs, "runs": [run]}).encode()))
    return Recording(file, Path("/a-test"))


def give_all(recording: Recording) -> None:
    recording.give("parameters", {"names": ("a", "b"), "limits": [[1.0, 2], [3.0]], "is_on": True})
    recording.give("publish scan", scan())


def ask(recording: Recording, x: float) -> Any:
    request = ToLL._request_class()
    request.map_point.x = x
    return recording.call("toLL", ToLL, request)


@pytest.mark.parametrize(
    ("name", "value", "complaint"),
    [
        ("parameters", {**INPUTS[0]["value"], "names": ["a", "c"]}, r"\.value\.names\[1\]: 'b' and 'c'"),
        ("parameters", {**INPUTS[0]["value"], "names": ["a"]}, r"\.value\.names: 2 and 1 elements"),
        ("parameters", {**INPUTS[0]["value"], "is_on": False}, r"\.value\.is_on: True and False"),
        ("parameters", {**INPUTS[0]["value"], "more": 1}, r"\.value: only one of them has \['more'\]"),
        ("arguments", [], "it has parameters "),
        ("parameters", Scan(), "it has parameters "),
    ],
)  # fmt: skip
def test_a_misfit_names_the_place(recording: Recording, name: str, value: Any, complaint: str) -> None:
    with pytest.raises(AssertionError, match=rf"input 0 \({name}\): {complaint}"):
        recording.give(name, value)


def test_a_misfit_of_a_message_or_a_call_names_the_place(recording: Recording) -> None:
    recording.give("parameters", INPUTS[0]["value"])
    other = scan()
    other.ranges[2] = 1.6
    with pytest.raises(AssertionError, match=r"input 1 .*\.value\.ranges\[2\]: 1.5 and 1.6"):
        recording.give("publish scan", other)
    with pytest.raises(AssertionError, match=r"call 0 \(toLL\): \.request\.map_point\.x: 1.0 and 3.0"):
        ask(recording, 3.0)


def test_what_is_left_out_or_given_in_addition_is_an_error(recording: Recording) -> None:
    with pytest.raises(AssertionError, match=r"more inputs: \['parameters', 'publish scan'\]"):
        recording.finish()
    give_all(recording)
    with pytest.raises(AssertionError, match=r"input 2 \(command\): it has no more inputs"):
        recording.give("command", [1.0])
    with pytest.raises(AssertionError, match=r"more calls: \['toLL', 'toLL'\]"):
        recording.finish()
    ask(recording, 1.0)
    with pytest.raises(PiprosError):
        ask(recording, 2.0)
    with pytest.raises(AssertionError, match="no call 2"):
        ask(recording, 4.0)
    with pytest.raises(AssertionError, match="steps of the test"):
        recording.finish()


def test_a_passed_test_that_leaves_out_an_input_fails(tmp_path: Path) -> None:
    (tmp_path / "conftest.py").write_text(
        "from tests.golden.navigation.conftest import pytest_runtest_call\n"
    )
    (tmp_path / "test_it.py").write_text(
        "import gzip, json, pytest\n"
        "from tests.support.recordings import Recording\n"
        "@pytest.fixture\n"
        "def recording(tmp_path):\n"
        "    file = tmp_path / 'it.json.gz'\n"
        f"    data = {{'inputs': {INPUTS[:1]}, 'runs': [{RUN}]}}\n"
        "    file.write_bytes(gzip.compress(json.dumps(data).encode()))\n"
        "    return Recording(file, tmp_path)\n"
        "@pytest.mark.parametrize('values', [['a', 'b'], None])\n"
        "def test_it(recording, values):\n"
        f"    if values: recording.give('parameters', {INPUTS[0]['value']})\n"
    )
    ended = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path)],
        cwd=tmp_path, env={"PATH": "/usr/bin:/bin", "PYTHONPATH": TEST_PATH},
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip

    assert "1 failed, 1 passed" in ended.stdout, ended.stdout
    assert "the recording has more inputs: ['parameters']" in ended.stdout


def test_every_recording_belongs_to_a_test_and_every_such_test_has_one() -> None:
    tests: list[str] = []
    words = [sys.executable, "-m", "pytest", "--collect-only", "-q", "tests/golden/navigation"]
    for more in ([], ["--long"]):
        folder = REPOSITORY / "plugins" / "pipros-robot"
        collected = subprocess.run(
            words + more, cwd=folder, capture_output=True, text=True, timeout=120, check=True
        )
        lines = collected.stdout.splitlines()
        tests += (line for line in lines if line.startswith("plugins/pipros-robot/tests/golden/navigation/"))

    assert {file_of(test) for test in tests} == set(files_below(FOLDER, "*.json.gz"))


def test_the_inputs_of_all_recordings_are_those_that_were_recorded() -> None:
    for file in files_below(FOLDER, "*.json.gz"):
        data = json.loads(gzip.decompress(file.read_bytes()))
        text = json.dumps(data["inputs"], separators=(",", ":"), sort_keys=True)
        assert data["digest"] == hashlib.sha256(text.encode()).hexdigest(), file
        assert file_of(data["test"]) == file
