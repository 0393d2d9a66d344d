"""The libraries for images, transforms and diagnostics give the results of genuine ones."""

import json
import math
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros_libraries.vision.calibration import Calibration, formatted
from pipros_libraries.vision.calibration_files import save
from rosbag import Bag
from tests.interop.programs.examine_diagnostics import __file__ as script
from tests.support.environments import SOURCE_PATH
from tests.support.ros import RosSystem
from tests.support.same_results import both_results, different_pairs, is_near, printed
from tests.support.waiting import wait_until

PROGRAMS = Path(__file__).parent / "programs"
GENUINE = "/usr/bin/python3"
PYKDL = next(Path("/usr/lib/python3/dist-packages").glob("PyKDL.cpython*.so"))


def asked(python: str, program: str, *arguments: int | str, **environment: str) -> Any:
    command = [python, PROGRAMS / f"{program}.py", *map(str, arguments)]
    said = printed(*command, environment={"PATH": "/usr/bin:/bin", **environment})
    # libraries also log to standard output
    return json.loads(next(line for line in said.splitlines() if line.startswith(("{", "[["))))


def differing(genuine: dict[str, Any], ours: dict[str, Any]) -> dict[str, tuple[Any, Any]]:
    assert genuine.keys() == ours.keys()
    return {name: (genuine[name], ours[name]) for name in genuine if not is_near(genuine[name], ours[name])}


def test_cv_bridge_makes_the_same_images() -> None:
    genuine = asked(GENUINE, "examine_cv_bridge", 2)

    assert len(genuine) > 5000
    assert differing(genuine, asked(sys.executable, "examine_cv_bridge", 2)) == {}
    # also with Debian's numpy, which is older
    ours = asked(GENUINE, "examine_cv_bridge", 2, PYTHONPATH=SOURCE_PATH)
    assert differing(genuine, ours) == {}


def test_compressed_and_rectified_images_are_the_same_bytes() -> None:
    ours = asked(GENUINE, "examine_compressed_images", 1, PYTHONPATH=SOURCE_PATH)

    assert differing(asked(GENUINE, "examine_compressed_images", 1), ours) == {}


@pytest.mark.parametrize(
    "program", ["examine_cameras", "examine_lasers", "examine_calibrations"],
    ids=["pixels and rays of cameras", "scans and angles", "files of calibrations"],
)  # fmt: skip
def test_values_are_the_same(program: str) -> None:
    assert differing(asked(GENUINE, program, 1), asked(sys.executable, program, 1)) == {}


def test_vectors_of_kdl_move_as_points_of_messages() -> None:
    """Not compared with genuine tf2_kdl, which fails with Debian's PyKDL."""
    genuine = asked(GENUINE, "examine_kdl", "messages")
    ours = asked(GENUINE, "examine_kdl", "kdl", PYTHONPATH=SOURCE_PATH)

    assert differing(genuine, ours) == {}


@pytest.mark.parametrize("ending", ["yaml", "ini"])
@pytest.mark.parametrize("name", ["left", "a: b #c", "narrow_stereo/left", "käse", ""])
def test_files_of_calibrations_are_written_alike(name: str, ending: str, tmp_path: Path) -> None:
    values = (1.23456789012345678, 1e-20, 3e300, 1234567.891, -0.0, 6e20, 0.1, math.inf, math.nan)
    calibration = Calibration(name, 640, 480, "plumb_bob", values[:5], values, values, values + values[:3])
    first, second = tmp_path / "first.yaml", tmp_path / f"second.{ending}"
    save(str(first), calibration)

    printed("/usr/lib/camera_calibration_parsers/convert", first, second)

    assert formatted(calibration, str(second)) == second.read_text()


def test_poses_are_converted_alike_with_pykdl(tmp_path: Path) -> None:
    if f"cpython-{sys.version_info.major}{sys.version_info.minor}-" not in PYKDL.name:
        program = "import tf_conversions; tf_conversions.Frame"
        refused = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
        assert "needs PyKDL" in refused.stderr
        return
    (tmp_path / PYKDL.name).symlink_to(PYKDL)

    genuine = asked(GENUINE, "examine_conversions", 1)
    ours = asked(sys.executable, "examine_conversions", 1, PYTHONPATH=str(tmp_path))

    assert is_near(ours[0], genuine[0])
    assert set(genuine[1]) - set(ours[1]) == set()


@pytest.mark.parametrize("seed", [1, 2])
def test_message_filters_form_the_same_sets_in_the_same_order(seed: int) -> None:
    ours, genuine = (asked(python, "examine_filters", seed, 300) for python in (sys.executable, GENUINE))
    assert ours == genuine


@pytest.mark.parametrize("seed", [1, 2])
def test_every_function_of_transformations_has_the_same_results(seed: int) -> None:
    differing = different_pairs(*both_results(str(PROGRAMS / "examine_transformations.py"), seed, 40))

    # Because eigenvalues lose digits, each side sometimes refuses a shear matrix.
    refused = ["shear_from_matrix", "raises ValueError"]
    assert [pair for pair in differing if refused not in pair] == []


# Diagnostics of both sides: the same reports, tables and monitors.


def test_tasks_report_alike_on_random_events() -> None:
    genuine, ours = (printed(python, script, "1", "200") for python in ("/usr/bin/python3", sys.executable))
    assert json.loads(ours) == json.loads(genuine)


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


# The monitors of diagnostic_common_diagnostics report under the names of the genuine ones.

MONITORS = [
    ("cpu_monitor.py", ["_warning_percentage:=100", "_window:=2"], ["CPU Information"]),
    ("ram_monitor.py", ["_warning_percentage:=100", "_rate:=20"], ["RAM Information"]),
    ("sensors_monitor.py", [], ["Sensor Status"]),
    ("hd_monitor.py", ["--diag-hostname=cX", "/"], ["HD Temperature", "HD Usage"]),
]


@pytest.mark.parametrize(("program", "arguments", "ends"), MONITORS)
def test_names_and_keys_are_those_of_genuine(plain_ros, program, arguments, ends: list[str]) -> None:
    plain_ros.serve_master()
    seen = {side: reported(plain_ros, side, program, arguments, ends) for side in ("genuine", "pipros")}

    assert seen["pipros"].keys() == seen["genuine"].keys()
    for name, (hardware_id, keys) in seen["genuine"].items():
        assert seen["pipros"][name][0] == hardware_id
        # Sensors depend on the hardware, and the genuine monitor cannot read disk space under Python 3.
        if name.endswith("Information"):
            assert seen["pipros"][name][1] == keys


SENDERS = [
    ("one", "map", "base"), ("two", "odom", "base"), ("three", "left", "right"), ("four", "right", "left"),
]  # fmt: skip
"""Nodes that send a transform each: two that give a frame different parents, two that form a cycle."""


def test_faulty_transforms_are_reported_as_by_genuine(plain_ros: RosSystem) -> None:
    plain_ros.serve_master()
    for name, parent, child in SENDERS:
        numbers = ["0"] * 6
        publisher = ["rosrun", "tf", "static_transform_publisher", *numbers, parent, child, "20"]
        plain_ros.pipros.start(*publisher, f"__name:={name}")

    seen = {side: faults_told(plain_ros, side) for side in ("genuine", "pipros")}

    assert seen["pipros"] == seen["genuine"]


def faults_told(ros: RosSystem, side: str) -> dict[str, tuple[int, str, frozenset[str]]]:
    """Return level, message and texts of each status of tf_monitor.py, once it has data of all nodes."""
    came: dict[str, tuple[int, str, frozenset[str]]] = {}

    def keep(array: Any) -> None:
        for status in array.status:
            texts = frozenset(pair.value for pair in status.values)
            came[status.name] = (status.level, status.message, texts)

    with Node(f"probe_{side}", environment=Environment(master_uri=ros.master_uri)) as node:
        node.subscribe("/diagnostics", DiagnosticArray, keep)
        started = getattr(ros, side).start("rosrun", "diagnostic_common_diagnostics", "tf_monitor.py")

        def complete() -> dict[str, tuple[int, str, frozenset[str]]] | None:
            seen = dict(came)  # the next messages may have other faults, if this machine is busy
            counts = {name.rpartition(": ")[2]: len(texts) for name, (_, _, texts) in seen.items()}
            is_complete = counts == {
                "Messaging status": 0, "Time status": 0, "Reparenting status": 2, "Cycle status": 2,
                "Multiple authority status": 2,
            } and all(message != "Node starting up" for _, message, _ in seen.values())  # fmt: skip
            return seen if is_complete else None

        seen = wait_until(complete, 120, lambda: f"{came} {started.output}")
        started.end()
    assert seen is not None
    return seen


def reported(
    ros: RosSystem, side: str, program: str, arguments: list[str], ends: list[str]
) -> Mapping[str, tuple[str, list[str]]]:
    """Return the hardware and the keys of each status of a program, once all have values."""
    came: dict[str, Any] = {}
    with Node(f"probe_{side}", environment=Environment(master_uri=ros.master_uri)) as node:
        node.subscribe(
            "/diagnostics", DiagnosticArray,
            lambda array: came.update({status.name: status for status in array.status}),
        )  # fmt: skip
        started = getattr(ros, side).start("rosrun", "diagnostic_common_diagnostics", program, *arguments)

        def is_complete() -> bool:
            ready = [name for name, status in list(came.items()) if is_filled(status)]
            return all(any(name.endswith(end) for name in ready) for end in ends)

        wait_until(is_complete, 60, lambda: f"{came} {started.output}")
        started.end()
    return {
        name: (status.hardware_id, [pair.key for pair in status.values])
        for name, status in came.items()
        if any(name.endswith(end) for end in ends)
    }


def is_filled(status: Any) -> bool:
    """Return False for the first statuses: the node is starting up, or has not read any data yet."""
    is_first = status.message == "Node starting up"
    return not is_first and not any(pair.value == "No Data" for pair in status.values)
