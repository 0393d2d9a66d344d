"""Libraries of both sides have the same results for random arguments: images, cameras, filters, rotations."""

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
from tests.support.same_results import both_results, different_pairs, is_near, printed

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
