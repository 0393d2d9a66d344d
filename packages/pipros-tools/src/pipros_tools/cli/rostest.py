"""`rostest [package] file`: runs each test of a launch file together with the file's nodes."""

from __future__ import annotations

import os
import signal
import sys
import unittest
from collections.abc import Sequence
from dataclasses import dataclass
from optparse import OptionParser
from pathlib import Path

from pipros.basics.env import Environment
from pipros.basics.errors import NotFound, PiprosError
from pipros.basics.interrupts import accept_ctrl_c
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import add_flag
from pipros_tools.launch.arguments import split_arguments
from pipros_tools.launch.console import Console
from pipros_tools.launch.find_launch_files import resolve_files
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.logs import LogFolder
from pipros_tools.launch.xml import load
from pipros_tools.testing.fixture import LaunchFixture
from pipros_tools.testing.result_paths import NoPlaceForResults, results_file, rostest_name
from pipros_tools.testing.results import Suite, Totals
from pipros_tools.testing.rostest import Plan, Rostest
from pipros_tools.testing.script_runner import make_xml_runner
from pipros_tools.testing.summary import runner_summary
from pipros_workspace.index import Package, PackageIndex

COULD_NOT_RUN = 1
CASES_FAILED = 2
INTERRUPTED = 130
"""128 + SIGINT, the exit code that shells report."""


@dataclass(frozen=True, slots=True)
class Options:
    """The options of genuine rostest."""

    text: bool
    package_folder: str | None
    package: str | None
    results_filename: str | None
    results_base: str | None
    reuse_master: bool
    clear: bool
    words: tuple[str, ...]


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the tests.

    Return 0 if all tests passed, 1 if a test could not run, 2 if test cases failed, 130 after Ctrl-C. With
    `--text`, return 0 even if test cases failed.
    """
    accept_ctrl_c()
    arguments, words = split_arguments(sys.argv[1:] if argv is None else argv)
    parser = _parser()
    options = _parse(parser, words)
    if options.clear and not options.reuse_master:
        print("The --clear option is only valid with --reuse-master", file=sys.stderr)
        return COULD_NOT_RUN
    environment = Environment.from_os()
    index = PackageIndex.from_environment(environment)
    try:
        files = resolve_files(options.words[:2], index)
        console, log = _open_log(environment)
        if not files:
            parser.error("You must supply a test file argument to rostest.")
        if len(files) + len(options.words[2:]) > 1:
            parser.error("rostest only accepts a single test file")
        file = Path(files[0]).absolute()
        package = _package_of(file, options, index)
        launch = load([str(file)], arguments, context=LoadContext.of_process(index))
        launch.check_machines()
    except PiprosError as error:
        print(error, file=sys.stderr)
        return COULD_NOT_RUN
    base = Path(options.results_base).absolute() if options.results_base else None
    rostest = Rostest(
        Plan(package.name, file, launch, base, options.text),
        index,
        lambda: LaunchFixture(
            launch,
            index,
            environment,
            console,
            reuse_master=options.reuse_master,
            clear=options.clear,
            text=options.text,
        ),
    )
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        if options.text:
            code = _run_as_text(rostest)
        else:
            given = options.results_filename or ""
            name = given.rpartition(".")[0] or given or rostest_name(package.path, file)
            code = _run(rostest, package.name, name, base)
    except KeyboardInterrupt:
        # A second Ctrl-C must not prevent the nodes from being stopped; they are killed after a timeout.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        rostest.tear_down()
        print("rostest was interrupted: no results", file=sys.stderr)
        return INTERRUPTED
    except NoPlaceForResults as error:
        print(error, file=sys.stderr)
        return COULD_NOT_RUN
    finally:
        console.close()
    print(f"rostest log file is in {log}")
    return code


def _run(rostest: Rostest, package: str, name: str, base: Path | None) -> int:
    file = results_file(package, name, is_rostest=True, base=base)
    result = make_xml_runner(package, name, file, is_rostest=True).run(rostest.suite())
    if rostest.was_set_up:
        print()
    ran = [suite for _, suite in rostest.results]
    print(runner_summary(Suite("rostest", tuple(result.cases)), rostest.results))
    if not result.wasSuccessful():
        return COULD_NOT_RUN
    return 0 if Totals.of(ran).passed else CASES_FAILED


def _run_as_text(rostest: Rostest) -> int:
    """Run the tests, which print their own reports. Return 0 if they could be run, even if cases failed."""
    result = unittest.TextTestRunner(verbosity=2).run(rostest.suite())
    print("\nWARNING: overall test result is not accurate when --text is enabled")
    return 0 if result.wasSuccessful() else COULD_NOT_RUN


def _open_log(environment: Environment) -> tuple[Console, Path]:
    """Open this process's log file and print its path. Return the console for all fixtures, and the path."""
    folder = LogFolder(environment.log_dir.absolute())
    log = folder.file_of_launcher("rostest")
    console = Console(has_title=False)
    console.open_log(log)
    os.environ["ROS_LOG_FILENAME"] = str(log)
    print(f"... logging to {log}", flush=True)
    return console, log


def _package_of(file: Path, options: Options, index: PackageIndex) -> Package:
    """Return the package to which the results belong; by default, the package that contains the file."""
    found = index.containing(file)
    folder = Path(options.package_folder).absolute() if options.package_folder else None
    if options.package and (folder or found):
        return Package(options.package, folder or (found.path if found else file.parent))
    if found is None:
        raise NotFound(
            f"[{file}] is not inside a ROS package, so its results cannot be named. "
            "Give the package with --package=NAME --pkgdir=FOLDER"
        )
    return Package(found.name, folder or found.path)


def _parse(parser: OptionParser, words: Sequence[str]) -> Options:
    values, rest = parser.parse_args(list(words))
    return Options(
        text=bool(values.text_mode),
        package_folder=values.pkg_dir,
        package=values.package,
        results_filename=values.results_filename,
        results_base=values.results_base_dir,
        reuse_master=bool(values.reuse_master),
        clear=bool(values.clear),
        words=tuple(rest),
    )


def _parser() -> OptionParser:
    parser = OptionParser(usage="%prog [options] [package] <filename>", prog="rostest")
    add_flag(
        parser,
        "-t",
        "--text",
        dest="text_mode",
        help="print the tests' own reports, and write no result files",
    )
    parser.add_option("--pkgdir", metavar="PKG_DIR", dest="pkg_dir", help="folder of the package")
    parser.add_option("--package", metavar="PACKAGE", help="name of the package")
    parser.add_option(
        "--results-filename", metavar="NAME", help="write rostest-NAME.xml (default: named after the file)"
    )
    parser.add_option(
        "--results-base-dir",
        metavar="FOLDER",
        help="folder for the results, with one subfolder per package",
    )
    add_flag(
        parser,
        "-r",
        "--reuse-master",
        help="use the running ROS master instead of starting one on a free port",
    )
    add_flag(
        parser,
        "-c",
        "--clear",
        help="clear the parameters of the running master first (only with --reuse-master)",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
