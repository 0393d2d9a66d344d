"""Calibrations of cameras in files, and the URLs that name such files."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping

from pipros.input_file import read_text
from pipros.vision.calibration import Calibration, CalibrationError, formatted, parse

FILE, PACKAGE = "file://", "package://"

_VARIABLE = re.compile(r"\$\{(\w+)\}")


def load(path: str) -> Calibration:
    """The calibration in a file.

    Raises:
        OSError: it cannot be read.
        CalibrationError: it is not a calibration.
    """
    try:
        return parse(read_text(path), path)
    except UnicodeDecodeError as error:
        raise CalibrationError(f"{path}: it is not UTF-8: {error}") from None


def save(path: str, calibration: Calibration) -> None:
    """Writes a calibration to a file, atomically; its folders are created.

    Raises:
        OSError: it cannot be written.
        CalibrationError: the format that the suffix names cannot hold it.
    """
    text = formatted(calibration, path)
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    unfinished = f"{path}.{os.getpid()}.unfinished"
    try:
        with open(unfinished, "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(unfinished, path)
    except OSError:
        if os.path.exists(unfinished):
            os.unlink(unfinished)
        raise


def resolved(url: str, camera_name: str, environment: Mapping[str, str]) -> tuple[str, list[str]]:
    """A URL with ${NAME} and ${ROS_HOME} replaced, and the names of unset variables.

    ${ROS_HOME} defaults to .ros in the user's folder.
    """
    unknown = []

    def value(match: re.Match[str]) -> str:
        if match[1] == "NAME":
            return camera_name
        if match[1] == "ROS_HOME":
            return environment.get("ROS_HOME") or os.path.join(os.path.expanduser("~"), ".ros")
        unknown.append(match[1])
        return match[0]

    return _VARIABLE.sub(value, url), unknown
