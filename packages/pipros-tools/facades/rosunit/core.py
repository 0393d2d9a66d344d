"""Test programs' result files, and rosunit's console output."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.lazy_names import star_names as _star_names
from pipros.node.program_log import make_folders_as_parent
from pipros_tools.testing import result_paths, script_runner
from pipros_tools.testing.result_paths import XML_OUTPUT_FLAG
from pipros_tools.testing.runner import XmlRunner
from rosunit.xmlrunner import XMLTestRunner

__all__ = [
    "XML_OUTPUT_FLAG",
    "XMLTestRunner",
    "create_xml_runner",
    "makedirs_with_parent_perms",
    "printerrlog",
    "printlog",
    "printlog_bold",
    "rostest_name_from_path",
    "xml_results_file",
]

_star_names(__name__, "errno os rospkg sys")


def _filled_in(msg: str, args: tuple[object, ...]) -> str:
    return f"[ROSUNIT]{msg % args if args else msg}"


def printlog(msg: str, *args: object) -> None:
    """Print to standard output; `args` are the arguments for `%` formatting."""
    print(_filled_in(msg, args))


def printlog_bold(msg: str, *args: object) -> None:
    """Print to standard output in bold; see `printlog`."""
    print(f"\033[1m{_filled_in(msg, args)}\033[0m")


def printerrlog(msg: str, *args: object) -> None:
    """Print to standard error; see `printlog`."""
    print(_filled_in(msg, args), file=sys.stderr)


def makedirs_with_parent_perms(p: str) -> None:
    """Create a folder and its missing parents, each with the owner and permissions of its parent."""
    make_folders_as_parent(Path(os.path.abspath(p)))


def xml_results_file(
    test_pkg: str, test_name: str, is_rostest: bool = False, env: dict[str, Any] | None = None
) -> str:
    """Return the path of a test's result file, and create its folder.

    Raises:
        OSError: the folder cannot be created.
    """
    path = result_paths.results_file(
        test_pkg, test_name, is_rostest=is_rostest, environment=Environment.from_os(env)
    )
    makedirs_with_parent_perms(str(path.parent))
    return str(path)


def rostest_name_from_path(pkg_dir: str, test_file: str) -> str:
    """Return the name of a launch file as used in result files.

    The name is the path relative to the package, or the given path if the file is outside the package,
    without its suffix, and with underscores for slashes.
    """
    path = Path(os.path.abspath(test_file))
    if not path.is_relative_to(pkg_dir):
        return str(Path(test_file).with_suffix("")).replace(os.sep, "_")
    return result_paths.rostest_name(Path(pkg_dir), path)


def create_xml_runner(
    test_pkg: str, test_name: str, results_file: str | None = None, is_rostest: bool = False
) -> XmlRunner:
    """Return a unittest runner that writes a result file."""
    return script_runner.make_xml_runner(test_pkg, test_name, results_file, is_rostest=is_rostest)
