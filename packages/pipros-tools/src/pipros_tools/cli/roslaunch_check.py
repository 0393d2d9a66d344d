"""`roslaunch-check`: checks one launch file, or all launch files in a folder, and writes a result file.

With `--survey` or `--csv`, it lists the programs in many launch files, with the provider of each.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from optparse import OptionParser
from pathlib import Path

from pipros.basics.errors import NotFound
from pipros.basics.names import without_launch_arguments
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import add_flag, run
from pipros_tools.launch.check import mistakes
from pipros_tools.testing.result_paths import prepare_path, results_file, write_results
from pipros_tools.testing.results import Case, Outcome, Suite
from pipros_tools.testing.xunit import format_suite
from pipros_workspace.index import PackageIndex

_CLASS_NAME = "roslaunch.RoslaunchCheck"


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Check the files. Return 0 if there are no errors; otherwise print all errors to stderr and return 1.

    For the exit codes with `--survey` and `--csv`, see `launch_survey`.
    """
    parser = OptionParser(
        usage="usage: %prog [options] <file|directory> [env=value...]\n"
        "       %prog --survey DIRECTORY...\n       %prog --csv FILE [--without PACKAGES]",
        prog="roslaunch-check",
    )
    parser.add_option(
        *("-o", "--output-file"), dest="output_file", metavar="FILE", help="file to store test results in"
    )
    add_flag(
        parser,
        "-t",
        "--use-test-depends",
        dest="test_depends",
        help="Assuming packages listed in test_depends are also installed",
    )
    add_flag(parser, "-i", "--ignore-unset-args", help="Ignore check for default value of <arg> parameters")
    add_flag(parser, "--survey", help="list the programs in directories' launch files, and who provides them")
    parser.add_option("--csv", metavar="FILE", help="like --survey, for the nodes listed in a CSV file")
    parser.add_option(
        "--without",
        metavar="PACKAGES",
        help="with --csv: also count as if pipros lacked these packages ('a b')",
    )
    options, words = parser.parse_args(without_launch_arguments(sys.argv[1:] if argv is None else argv))
    if options.csv or options.survey:
        if bool(words) is bool(options.csv) or (options.csv and options.survey):
            parser.error("give either --survey with directories, or --csv with a file")
        from pipros_tools.cli.launch_survey import survey_csv, survey_trees

        without = (options.without or "").replace(",", " ").split()
        return run(
            lambda: survey_csv(options.csv, without) if options.csv else survey_trees(words), error_code=2
        )
    if not words:
        parser.error("please specify a file or directory for roslaunch files to test")
    for word in words[1:]:
        name, separator, value = word.partition("=")
        if not separator:
            parser.error(f"[{word}] must have the form env=value")
        os.environ[name] = value
    return run(
        lambda: _check(
            Path(words[0]),
            Path(options.output_file) if options.output_file else None,
            with_test_depends=options.test_depends,
            ignore_unset=options.ignore_unset_args,
        )
    )


def _check(path: Path, output: Path | None, *, with_test_depends: bool, ignore_unset: bool) -> int:
    index = PackageIndex.from_environment()
    owner = index.containing(path.absolute())
    if not path.exists():
        raise NotFound(f"[{path}] does not exist")
    if owner is None:
        raise NotFound(f"[{path}] is not inside a ROS package on ROS_PACKAGE_PATH")
    found: list[str] = []
    for file in _launch_files(path):
        print("checking", file)
        wrong = mistakes(
            file.absolute(), index, with_test_depends=with_test_depends, ignore_unset=ignore_unset
        )
        if wrong:
            found.append(f"[{file}]:\n\t" + "\n".join(wrong))
    inside = os.path.relpath(path.absolute(), owner.path)
    label = "_pkg" if inside == "." else inside.replace(".", "_").replace(os.sep, "_")
    result = output or results_file(owner.name, f"roslaunch_check_{label}")
    print("...writing test results to", result, flush=True)
    prepare_path(result)
    suite = _suite(output.name if output else str(path), f"{owner.name}_{label}", path, found)
    write_results(result, format_suite(suite))
    if not found:
        print("passed")
        return 0
    print("FAILURE:\n" + "\n".join(found), file=sys.stderr)
    print(f"wrote test file to [{result}]", file=sys.stderr)
    return 1


def _launch_files(path: Path) -> list[Path]:
    if path.is_file():
        return [path]
    print("checking *.launch in directory", path)
    files = []
    for folder, folders, names in os.walk(path):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        files += [Path(folder) / name for name in sorted(names) if name.endswith(".launch")]
    return files


def _suite(name: str, case_name: str, path: Path, found: list[str]) -> Suite:
    case = Case(_CLASS_NAME, case_name)
    if found:
        text = f"roslaunch check [{path}] failed"
        case = Case(_CLASS_NAME, case_name, outcome=Outcome.FAILURE, text=text)
    return Suite(name, (case,), stdout="\n".join(found))


if __name__ == "__main__":
    sys.exit(main())
