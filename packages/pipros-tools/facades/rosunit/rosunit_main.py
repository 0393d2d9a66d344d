"""The command `rosunit`."""

from __future__ import annotations

import sys

from pipros.basics.lazy_names import star_names as _star_names
from rosunit.baretest import BareTestCase, print_runner_summary
from rosunit.core import create_xml_runner, xml_results_file
from rosunit.junitxml import Result, print_summary

__all__ = [
    "BareTestCase",
    "Result",
    "create_xml_runner",
    "print_runner_summary",
    "print_summary",
    "rosunitmain",
    "xml_results_file",
]

_star_names(__name__, "os rospkg sys unittest")


def rosunitmain() -> None:
    """Run the command with the command line of this process. Exit the process on failure."""
    from pipros_tools.cli.rosunit import main

    code = main()
    if code:
        sys.exit(code)
