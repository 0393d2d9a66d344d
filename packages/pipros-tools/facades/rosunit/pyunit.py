"""`unitrun`, which Python test scripts call at the end."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from pipros.basics.lazy_names import star_names as _star_names
from pipros_tools.testing import script_runner
from pipros_tools.testing.result_paths import XML_OUTPUT_FLAG
from rosunit.baretest import print_unittest_summary
from rosunit.core import create_xml_runner

__all__ = [
    "XML_OUTPUT_FLAG",
    "create_xml_runner",
    "print_unittest_summary",
    "start_coverage",
    "stop_coverage",
    "unitrun",
]

_star_names(__name__, "sys")


def unitrun(
    package: str,
    test_name: str,
    test: script_runner.Tests,
    sysargs: Sequence[str] | None = None,
    coverage_packages: Sequence[str] | None = None,
) -> None:
    """Run tests that do not need a ROS system. Exit with code 1 if they do not pass.

    Args:
        sysargs: the command line. `--cov` and `--covhtml` measure coverage, if `coverage` is installed.
        coverage_packages: the packages to include in the coverage report; defaults to the package of the
            test.
    """
    argv = sys.argv if sysargs is None else sysargs
    packages = [package] if coverage_packages is None else list(coverage_packages)
    is_measured = "--cov" in argv or "--covhtml" in argv
    if is_measured:
        start_coverage(packages)
    passed = script_runner.run_program(package, test_name, test, argv)
    if is_measured:
        stop_coverage(packages, html="covhtml" if "--covhtml" in argv else None)
    script_runner.exit_unless(passed)


_measuring: list[Any] = []


def start_coverage(packages: Sequence[str]) -> None:
    """Start measuring coverage, appending to earlier data. If `coverage` is missing, print a warning."""
    _ = packages
    try:
        import coverage
    except ImportError:
        print("WARNING: cannot measure coverage: run pip install coverage", file=sys.stderr)
        return
    measuring = coverage.Coverage()
    measuring.load()
    measuring.start()
    _measuring.append(measuring)


def stop_coverage(packages: Sequence[str], html: str | None = None) -> None:
    """Stop measuring coverage and report on packages, optionally also as HTML in the folder `html`."""
    if not _measuring:
        return
    measuring = _measuring.pop()
    measuring.stop()
    measuring.save()
    roots = tuple(map("{}.".format, packages))
    named = [module for name, module in list(sys.modules.items()) if f"{name}.".startswith(roots)]
    modules = [module for module in named if getattr(module, "__file__", None)]
    if not modules:
        print(f"WARNING: no coverage: {', '.join(packages)} was not imported", file=sys.stderr)
        return
    measuring.report(modules, show_missing=True)
    if html:
        measuring.html_report(modules, directory=html)
