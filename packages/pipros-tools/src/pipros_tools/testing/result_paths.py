"""Paths of result files: `<test results>/<package>/rosunit-<test>.xml` and `rostest-<file>.xml`."""

from __future__ import annotations

import os
from pathlib import Path

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.basics.replaced_file import write_whole


class NoPlaceForResults(PiprosError):
    """A result file cannot be written."""


_BAD_IN_NAMES = " \"'&$!`/\\"

XML_OUTPUT_FLAG = "--gtest_output=xml:"
"""Option that passes the path of the result file to a test program. C++ tests support it, because it is
gtest's option.
"""


def results_file(
    package: str,
    test_name: str,
    *,
    is_rostest: bool = False,
    base: Path | None = None,
    environment: Environment | None = None,
) -> Path:
    """Return a test's result file; blanks, slashes and quotes in its name become underscores, as in Noetic.

    `base` replaces the folder given by the environment.

    >>> results_file("composiv_tryouts", "composiv_talker", base=Path("/results")).as_posix()
    '/results/composiv_tryouts/rosunit-composiv_talker.xml'
    """
    folder = base or (environment or Environment.from_os()).test_results_dir
    runner = "rostest" if is_rostest else "rosunit"
    name = test_name.translate(dict.fromkeys(map(ord, _BAD_IN_NAMES), "_"))
    return folder / package / f"{runner}-{name}.xml"


def prepare_path(file: Path) -> bool:
    """Create a result file's folder, and remove the file if it exists. Return True if it existed.

    Raises:
        NoPlaceForResults: see `write_results`. This is checked before a test that takes long.
    """
    existed = os.path.lexists(file)
    write_results(file, " " * 4096)
    file.unlink()
    return existed


def write_results(file: Path, text: str) -> None:
    """Write a result file.

    Raises:
        NoPlaceForResults: the file cannot be written, for example because the disk is full; the message
            suggests a solution. No part of a file is left.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.unlink(missing_ok=True)
        write_whole(file, text.encode())
    except OSError as error:
        raise NoPlaceForResults(
            f"cannot write test results to [{file}]: {error.strerror}. "
            "Set ROS_TEST_RESULTS_DIR to a writable folder"
        ) from None


def rostest_name(package_folder: Path, test_file: Path) -> str:
    """Return a launch file's name for result files.

    The name is the path in the package without its suffix, with slashes replaced by underscores.

    >>> rostest_name(Path("/ws/src/pkg"), Path("/ws/src/pkg/test/talker.test"))
    'test_talker'
    """
    try:
        inside = test_file.relative_to(package_folder)
    except ValueError:  # use the whole path, as in Noetic
        inside = test_file
    return inside.with_suffix("").as_posix().replace("/", "_")
