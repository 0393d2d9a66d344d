"""Files with calibrations of cameras, and the URLs that name them."""

import math
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from sensor_msgs.msg import CameraInfo

import camera_info_manager as cim
import rospy
from camera_calibration_parsers import readCalibration, writeCalibration
from camera_info_manager import CameraInfoManager, CameraInfoMissingError
from pipros_libraries.vision.calibration import (
    Calibration,
    CalibrationError,
    format_ini,
    format_yaml,
    parse_ini,
    parse_yaml,
)

IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
LEFT = Calibration(
    "left", 640, 480, "plumb_bob", (0.5, 0.25, 0, 0, 0), (500, 0, 320, 0, 500, 240, 0, 0, 1), IDENTITY,
    (1.5,) * 12,
)  # fmt: skip


def test_yaml_is_read_as_it_was_written() -> None:
    odd = replace(LEFT, d=(1e-20, 1 / 3, -0.0, math.inf), model="equidistant", name="a: b # 'c'")

    assert (parse_yaml(format_yaml(LEFT)), parse_yaml(format_yaml(odd))) == (LEFT, odd)
    assert "data: [1e-20" not in format_yaml(odd)  # all 17 digits, like the genuine writer
    assert math.isnan(parse_yaml(format_yaml(replace(LEFT, k=(math.nan, *LEFT.k[1:])))).k[0])


def test_ini_is_read_as_it_was_written() -> None:
    assert parse_ini(format_ini(LEFT)) == LEFT
    assert parse_ini(format_ini(LEFT).replace("0.00000 \n\n", "0.0 1 2 3\n\n")).model == "rational_polynomial"


def test_handwritten_yaml_is_read() -> None:
    text = format_yaml(LEFT).replace("500", "5e2").replace("camera_name: left\n", "").replace("0.5,", "+.5,")

    assert parse_yaml(text) == replace(LEFT, name="unknown")


@pytest.mark.parametrize(("old", "new", "error"), [
    ("image_width: 640", "", "image_width must be an integer from 0 to 2**32 - 1, got nothing"),
    ("640", "640.5", "image_width must be an integer from 0 to 2**32 - 1, got '640.5'"),
    ("640", "9" * 5000, "<string>"),
    ("cols: 4", "cols: 3", "projection_matrix must be a matrix of 3 rows and 4 columns, got (3, 3)"),
    ("cols: 5", "cols: 6", "distortion_coefficients: data must be a list of 6 numbers, got ['0.5"),
    ("[500", "[x", "camera_matrix: data must be numbers, got 'x'"),
    ("[500", "[[1]", "camera_matrix: data must be numbers, got ['1']"),
    ("camera_name: left", "camera_name: [1]", "camera_name must be a string, got ['1']"),
    ("camera_matrix:", "other:", "camera_matrix must be a mapping with rows, cols and data, got nothing"),
    ("image_width", "[", "invalid YAML"),
])  # fmt: skip
def test_malformed_yaml_is_refused(old: str, new: str, error: str) -> None:
    with pytest.raises(CalibrationError, match=re.escape(error)):
        parse_yaml(format_yaml(LEFT).replace(old, new))


def test_tags_are_ignored_as_by_yaml_cpp() -> None:
    tagged = "other: !!python/object/apply:os.abort []\nimage_width: !own"
    assert parse_yaml(format_yaml(LEFT).replace("image_width:", tagged)) == LEFT


@pytest.mark.parametrize("text", ["", "- 1", "text", "[image]", "[image] width 1 height 1 [a] camera"])
def test_invalid_calibration_files_are_refused(text: str) -> None:
    with pytest.raises(CalibrationError):
        parse_yaml(text)
    with pytest.raises(CalibrationError, match=r"must have \[image\] with width and height, then \[NAME\]"):
        parse_ini(text)


@pytest.mark.parametrize("more", ["1" * 300_000 + "x", " 1" * 300_000, " " * 300_000, "+1" * 300_000])
def test_the_time_for_a_text_is_proportional_to_its_length(more: str) -> None:
    for start in ("[image] width 1 height 1 [a] camera matrix ", "[image] width 1 height 1 "):
        with pytest.raises(CalibrationError):
            parse_ini(start + more)


def test_an_ini_file_cannot_have_every_lens() -> None:
    with pytest.raises(CalibrationError, match="Use the YAML format instead"):
        format_ini(replace(LEFT, model="equidistant"))


def camera_info() -> CameraInfo:
    values = {"D": LEFT.d, "K": LEFT.k, "R": LEFT.r, "P": LEFT.p}
    return CameraInfo(width=640, height=480, distortion_model="plumb_bob", **values)


@pytest.mark.parametrize("ending", ["yaml", "yml", "ini"])
def test_a_message_survives_a_file(ending: str, tmp_path: Path) -> None:
    path = str(tmp_path / "cameras" / f"left.{ending}")

    assert writeCalibration(path, "left", camera_info())

    assert readCalibration(path) == ("left", camera_info())
    assert [file.name for file in (tmp_path / "cameras").iterdir()] == [f"left.{ending}"]


def test_unreadable_and_unwritable_calibrations_are_reported(tmp_path: Path, capsys) -> None:
    (tmp_path / "octets.yaml").write_bytes(b"\xff")

    assert readCalibration(str(tmp_path / "missing.yaml")) is None
    assert readCalibration(str(tmp_path)) is None
    assert readCalibration(str(tmp_path / "octets.yaml")) is None
    assert not writeCalibration(str(tmp_path / "left.txt"), "left", camera_info())
    assert not writeCalibration(str(tmp_path / "octets.yaml" / "left.yaml"), "left", camera_info())
    said = capsys.readouterr().err
    assert "No such file or directory" in said
    assert "is not UTF-8" in said
    assert "must end with .yaml, .yml or .ini, got" in said
    assert said.count("Failed to") == 5


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """ROS_HOME of managers whose service is not on a master."""
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    monkeypatch.setattr(rospy, "Service", lambda *_: None)
    return tmp_path


def set_camera_info(manager: CameraInfoManager, **more: Any) -> Any:
    request: Any = SimpleNamespace(camera_info=camera_info(), **more)
    return manager.setCameraInfo(request)


def test_a_camera_without_a_file_is_not_calibrated(home: Path) -> None:
    manager = CameraInfoManager("left")
    with pytest.raises(CameraInfoMissingError, match=r"Calibration missing, loadCameraInfo\(\) needed"):
        manager.getCameraInfo()
    with pytest.raises(CameraInfoMissingError):
        manager.isCalibrated()

    manager.loadCameraInfo()

    assert not manager.isCalibrated()
    assert manager.getCameraInfo() == CameraInfo()
    assert (manager.getCameraName(), manager.getURL()) == ("left", "")


def test_a_new_calibration_is_kept_in_the_home_of_ros(home: Path) -> None:
    manager, later = CameraInfoManager("left"), CameraInfoManager("left")

    assert set_camera_info(manager).success
    later.loadCameraInfo()

    assert manager.isCalibrated()
    assert later.getCameraInfo() == camera_info()
    assert (home / "camera_info" / "left.yaml").exists()


def test_a_calibration_may_be_in_a_package(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (home / "robot").mkdir()
    (home / "robot" / "package.xml").write_text("<package><name>robot</name></package>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(home))
    manager = CameraInfoManager("right", "package://robot/calibrations/${NAME}.ini")

    assert set_camera_info(manager).success

    assert "[right]" in (home / "robot" / "calibrations" / "right.ini").read_text()
    manager.loadCameraInfo()
    assert manager.isCalibrated()


@pytest.mark.parametrize("url", [
    "package://nowhere/a.yaml", "file:///${UNKNOWN}/a.txt", "http://a/b.yaml", "file://a", "package://robot",
])  # fmt: skip
def test_a_calibration_that_cannot_be_saved_is_reported(home: Path, url: str) -> None:
    answer = set_camera_info(CameraInfoManager("left", url))

    assert not answer.success
    assert answer.status_message == "Error storing camera calibration."


def test_names_and_urls_are_checked(home: Path) -> None:
    manager = CameraInfoManager("left")
    manager.loadCameraInfo()

    assert not manager.setCameraName("")
    assert not manager.setCameraName("left/right")
    assert not manager.setURL("http://a/b.yaml")
    assert manager.getCameraInfo() is not None
    assert manager.setURL("file:///calibrations/${NAME}.yaml")
    with pytest.raises(CameraInfoMissingError):
        manager.getCameraInfo()
    assert manager.setCameraName("right_2")
    assert cim.genCameraName("Acme 7/b-ä") == "Acme_7_b__"


@pytest.mark.parametrize(("url", "kind"), [
    ("", cim.URL_empty), ("file:///a", cim.URL_file), ("FILE:///a", cim.URL_file),
    ("file://a", cim.URL_invalid), ("package://a/b", cim.URL_package), ("package://a/", cim.URL_invalid),
    ("package:///b", cim.URL_invalid), ("flash:///b", cim.URL_invalid),
])  # fmt: skip
def test_urls_are_of_a_kind(url: str, kind: int) -> None:
    assert cim.parseURL(url) == kind


def test_variables_of_urls_are_replaced(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert cim.resolveURL("file://${ROS_HOME}/${NAME}${X}$NAME", "left") == f"file://{home}/left${{X}}$NAME"
    monkeypatch.delenv("ROS_HOME")
    monkeypatch.setenv("HOME", "/somewhere")
    assert cim.resolveURL("${ROS_HOME}", "left") == "/somewhere/.ros"


def test_the_name_in_a_file_may_differ(home: Path) -> None:
    assert cim.saveCalibrationFile(camera_info(), str(home / "a.yaml"), "left")

    assert cim.loadCalibrationFile(str(home / "a.yaml"), "right") == camera_info()


def test_a_package_that_does_not_exist_has_no_file(home: Path) -> None:
    assert cim.getPackageFileName("package://nowhere/a.yaml") == ""
