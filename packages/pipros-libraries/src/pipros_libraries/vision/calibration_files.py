"""Camera calibration files and their URLs."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path

from pipros.basics.input_file import read_text
from pipros.basics.replaced_file import write_whole
from pipros.basics.windows import file_url
from pipros_libraries.vision.calibration import Calibration, CalibrationError, formatted, parse

FILE, PACKAGE = "file://", "package://"

_VARIABLE = re.compile(r"\$\{(\w+)\}")


def load(path: str) -> Calibration:
    """Read the calibration from a file.

    Raises:
        OSError: the file cannot be read.
        CalibrationError: the file is not a valid calibration.
    """
    try:
        return parse(read_text(path), path)
    except UnicodeDecodeError as error:
        raise CalibrationError(f"{path} is not UTF-8: {error}") from None


def save(path: str, calibration: Calibration) -> None:
    """Write a calibration to a file atomically, creating missing folders.

    Raises:
        OSError: the file cannot be written.
        CalibrationError: the suffix is unknown, or its format does not support the calibration.
    """
    text = formatted(calibration, path)
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    write_whole(Path(path), text.encode())


def resolved(url: str, camera_name: str, environment: Mapping[str, str]) -> tuple[str, list[str]]:
    """Substitute ${NAME} and ${ROS_HOME} in a URL. Return the URL and the names of unknown variables.

    ${ROS_HOME} defaults to `~/.ros`. Unknown variables stay in the URL.
    """
    unknown = []

    def value(match: re.Match[str]) -> str:
        if match[1] == "NAME":
            return camera_name
        if match[1] == "ROS_HOME":
            home = environment.get("ROS_HOME") or os.path.join(os.path.expanduser("~"), ".ros")
            return file_url(home)[len(FILE) :]
        unknown.append(match[1])
        return match[0]

    return _VARIABLE.sub(value, url), unknown
