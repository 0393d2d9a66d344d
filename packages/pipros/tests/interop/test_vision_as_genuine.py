"""Images and cameras: the libraries of both sides have the same results for random arguments."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from pipros_libraries.vision.calibration import Calibration, formatted
from pipros_libraries.vision.calibration_files import save
from tests.support.environments import SOURCE_PATH
from tests.support.same_results import is_near

PROGRAMS = Path(__file__).parent / "programs"
GENUINE = "/usr/bin/python3"


def asked(python: str, program: str, argument: int | str, **environment: str) -> Any:
    ended = subprocess.run(
        [python, PROGRAMS / f"{program}.py", str(argument)],
        env={"PATH": "/usr/bin:/bin", **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    # libraries also log to standard output
    return json.loads(next(line for line in ended.stdout.splitlines() if line.startswith("{")))


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


def test_cameras_have_the_same_pixels_and_rays() -> None:
    genuine = asked(GENUINE, "examine_cameras", 1)

    assert differing(genuine, asked(sys.executable, "examine_cameras", 1)) == {}


def test_scans_and_angles_have_the_same_values() -> None:
    genuine = asked(GENUINE, "examine_lasers", 1)

    assert differing(genuine, asked(sys.executable, "examine_lasers", 1)) == {}


def test_vectors_of_kdl_move_as_points_of_messages() -> None:
    """Not compared with genuine tf2_kdl, which fails with Debian's PyKDL."""
    genuine = asked(GENUINE, "examine_kdl", "messages")
    ours = asked(GENUINE, "examine_kdl", "kdl", PYTHONPATH=SOURCE_PATH)

    assert differing(genuine, ours) == {}


def test_files_of_calibrations_are_read_alike() -> None:
    genuine = asked(GENUINE, "examine_calibrations", 1)

    assert differing(genuine, asked(sys.executable, "examine_calibrations", 1)) == {}


@pytest.mark.parametrize("ending", ["yaml", "ini"])
@pytest.mark.parametrize("name", ["left", "a: b #c", "narrow_stereo/left", "käse", ""])
def test_files_of_calibrations_are_written_alike(name: str, ending: str, tmp_path: Path) -> None:
    values = (1.23456789012345678, 1e-20, 3e300, 1234567.891, -0.0, 6e20, 0.1, math.inf, math.nan)
    calibration = Calibration(name, 640, 480, "plumb_bob", values[:5], values, values, values + values[:3])
    first, second = tmp_path / "first.yaml", tmp_path / f"second.{ending}"
    save(str(first), calibration)

    ended = subprocess.run(
        ["/usr/lib/camera_calibration_parsers/convert", first, second],
        env={"PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=False,
    )

    assert ended.returncode == 0, ended.stderr
    assert formatted(calibration, str(second)) == second.read_text()
