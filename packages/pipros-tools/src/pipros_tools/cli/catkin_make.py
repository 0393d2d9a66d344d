"""`catkin_make`: builds a workspace, without CMake if no compiler is needed."""

from __future__ import annotations

import os
import shutil
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from itertools import takewhile
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.basics.replaced_file import write_whole
from pipros_tools.cli.catkin_init_workspace import initialize
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.make_args import MakeArguments, read_make_arguments
from pipros_workspace import genuine_catkin, native_tools
from pipros_workspace.build import build
from pipros_workspace.build_options import BuildOptions
from pipros_workspace.build_result import BuildResult
from pipros_workspace.cmake_runs import NativeBuildFailed
from pipros_workspace.layout import WORKSPACE_MARKER, WorkspaceError, WorkspaceFolders
from pipros_workspace.make_targets import names as target_names

_MARKER_TEXT = (
    "# This file currently only serves to mark the location of a catkin workspace for tool integration\n"
)
_RED, _PLAIN = "\033[31m", "\033[0m"
_SCRIPT_RUNNER = [sys.executable, "-m", "pipros_tools.testing.script_runner"]


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Build the workspace. Return the exit code, which is 1 if a package or the whole build failed."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    options, definitions, for_make = _parse(arguments)
    targets = list(for_make.targets)
    layout = _layout(options, definitions)
    if layout.base.is_dir():
        print(f"Base path: {layout.base}", flush=True)
    try:
        _check(layout)
    except WorkspaceError as error:
        print(error, file=sys.stderr)
        return 1
    print(f"Source space: {layout.source}")
    print(f"Build space: {layout.build}")
    print(f"Devel space: {layout.devel}")
    print(f"Install space: {layout.install}")
    if "clean" in targets:
        return _clean(layout)
    toplevel = layout.source / "CMakeLists.txt"
    try:
        if not toplevel.exists() and not toplevel.is_symlink():
            print(initialize(layout.source))
        marker = layout.base / WORKSPACE_MARKER
        if not marker.exists():
            write_whole(marker, _MARKER_TEXT.encode())
        if options.force_cmake or for_make.is_forced:
            shutil.rmtree(layout.build / "pipros", ignore_errors=True)
        result = build(layout, _build_options(options, definitions, for_make), _print_line)
    except (PiprosError, OSError) as error:
        print(f"{_RED}{error}{_PLAIN}", file=sys.stderr)
        return 1
    tests = [target for target in targets if _is_test(target)]
    code = _report(result, has_more_to_do=bool(tests)) or _check_targets(targets, result, layout, definitions)
    if code == 0:
        _clean_results(targets, layout)
    if tests and code == 0:
        from pipros_workspace.run_tests import run_tests

        run_tests(result.projects, layout, tests, _print_line, _write_error_result, _SCRIPT_RUNNER)
    return code


def _check_targets(
    targets: list[str], result: BuildResult, layout: WorkspaceFolders, definitions: Mapping[str, str]
) -> int:
    """Pass unknown targets to genuine catkin if a package needs CMake. For `help`, print the known targets.

    Return 1 if an error was printed, otherwise 0.
    """
    known = set(target_names(result.projects))
    if definitions.get("CATKIN_ENABLE_TESTING", "ON").upper() in ("0", "OFF", "NO", "FALSE"):
        known -= {"run_tests", "tests"}
    for target in targets:
        if target in known:
            continue
        if any(project.needs_cmake for project in result.projects.values()):
            try:
                genuine_catkin.make(layout, target)
            except (native_tools.MissingTools, NativeBuildFailed) as error:
                print(f"{_RED}{error}{_PLAIN}", file=sys.stderr)
                return 1
        else:
            print(f"make: *** No rule to make target '{target}'.  Stop.", file=sys.stderr)
            print(f'{_RED}Invoking "make {target}" failed{_PLAIN}', file=sys.stderr)
            return 1
    if "help" in targets:
        print("The following are some of the valid targets for this Makefile:")
        print("\n".join(f"... {name}" for name in sorted(known)))
    return 0


def _clean_results(targets: list[str], layout: WorkspaceFolders) -> None:
    """Remove the test results that `clean_test_results` targets refer to."""
    for target in targets:
        if target == "clean_test_results" or target.startswith("clean_test_results_"):
            name = target.removeprefix("clean_test_results").removeprefix("_")
            shutil.rmtree(layout.build / "test_results" / name, ignore_errors=True)


def _write_error_result(file: Path, test: str, problem: str) -> None:
    """Write a result file for a test that could not be run."""
    from pipros_tools.testing.results import Case, Outcome, Suite
    from pipros_tools.testing.xunit import format_suite

    case = Case("run_tests", test, outcome=Outcome.ERROR, text=problem)
    write_whole(file, format_suite(Suite(test, (case,))).encode())


def _parse(arguments: list[str]) -> tuple[Namespace, dict[str, str], MakeArguments]:
    """Return the options, the `-D` settings and the arguments for make."""
    parser = ArgumentParser(
        prog="catkin_make",
        description="Creates the catkin workspace layout and builds it. Packages without compiled code are "
        "built by pipros itself; others by genuine catkin and CMake, if these are installed.",
    )
    add = parser.add_argument
    add("-C", "--directory", default=os.curdir, help="The base path of the workspace (default '.')")
    add("--source", help="The path to the source space (default 'workspace_base/src')")
    add("--build", help="The path to the build space (default 'workspace_base/build')")
    add("--use-ninja", action="store_true", help="Accepted for compatibility with Noetic; make is used")
    add("--use-nmake", action="store_true", help="Accepted for compatibility with Noetic; make is used")
    add("--use-gmake", action="store_true", help="Accepted for compatibility with Noetic; make is used")
    add("--force-cmake", action="store_true", help="Rebuild everything, even if unchanged")
    add("--no-color", action="store_true", help="Disables colored output")
    add("--pkg", nargs="+", metavar="PKG", default=[], help="Build specific packages and their dependencies")
    add(
        "--only-pkg-with-deps",
        nargs="+",
        default=[],
        metavar="PKG",
        help="Build only the specified packages and their dependencies",
    )
    add(
        "--cmake-args",
        nargs="*",
        default=[],
        help="Arguments which are passed to CMake, such as -DNAME=VALUE",
    )
    add("--make-args", nargs="*", default=[], help="Arguments which are passed to make")
    add("--override-build-tool-check", action="store_true", help="Accepted for compatibility with Noetic")
    # argparse treats every word with a leading dash as an option, even words after --cmake-args.
    settings = [word for word in arguments if word.startswith("-D") and len(word) > 2]
    words = [word for word in arguments if word not in settings]
    given = words.index("--make-args") if "--make-args" in words else len(words)
    for_make = read_make_arguments(words[given + 1 :])
    options, rest = parser.parse_known_args(words[:given])
    for_make += read_make_arguments(rest)
    if for_make.unknown:
        parser.error(f"unrecognized arguments: {' '.join(for_make.unknown)}")
    definitions = {}
    for setting in settings:
        name, sign, value = setting[2:].partition("=")
        if not sign:
            parser.error(f"Parse error in command line argument: {name}\n Should be: VAR:type=value")
        definitions[name.partition(":")[0]] = value
    return options, definitions, for_make


def _layout(options: Namespace, definitions: dict[str, str]) -> WorkspaceFolders:
    base = Path(options.directory).absolute().resolve()
    return WorkspaceFolders(
        base,
        base / (options.source or "src"),
        base / (options.build or "build"),
        base / definitions.pop("CATKIN_DEVEL_PREFIX", "devel"),
        base / definitions.pop("CMAKE_INSTALL_PREFIX", "install"),
    )


def _check(layout: WorkspaceFolders) -> None:
    """Check that the folders exist and form a workspace. The error texts begin like Noetic's.

    Raises:
        WorkspaceError: a folder does not exist, or the base folder is a package.
    """
    if not layout.base.is_dir():
        raise WorkspaceError(f'The specified base path "{layout.base}" does not exist')
    if (layout.base / "package.xml").is_file():
        raise WorkspaceError(
            f'The specified base path "{layout.base}" contains a package but "catkin_make" must be invoked '
            "in the root of workspace"
        )
    if not layout.source.is_dir():
        raise WorkspaceError(
            f'The specified source space "{layout.source}" does not exist\n'
            "Run catkin_make in the folder that contains src"
        )


def _build_options(options: Namespace, definitions: dict[str, str], for_make: MakeArguments) -> BuildOptions:
    targets = for_make.targets
    only = {*options.pkg, *options.only_pkg_with_deps}
    only.update(filter(None, definitions.get("CATKIN_WHITELIST_PACKAGES", "").split(";")))
    left_out = filter(None, definitions.get("CATKIN_BLACKLIST_PACKAGES", "").split(";"))
    return BuildOptions(
        frozenset(only),
        frozenset(left_out),
        definitions,
        installs="install" in targets,
        tests=any(_is_test(target) for target in targets),
        jobs=for_make.jobs,
        targets=targets,
    )


def _is_test(target: str) -> bool:
    return target in ("test", "run_tests") or target.startswith("run_tests_")


def _in_one_line(error: str) -> str:
    """Join an error's location and its reason: the next sentence of CMake, or a traceback's last line."""
    first, *rest = map(str.strip, error.strip().splitlines())
    if not first.endswith(":") or not rest:
        return first
    if rest[0].startswith("File "):
        return f"{first} {rest[-1]}"
    paragraph = " ".join(takewhile(bool, rest))  # CMake wraps lines, and ends sentences with two spaces
    sentence = rest[0] if rest[0].endswith(".") else paragraph.partition(".  ")[0]
    return f"{first} {sentence}"


def _report(result: BuildResult, *, has_more_to_do: bool) -> int:
    if result.errors:
        print(f"{_RED}{len(result.errors)} package(s) failed:{_PLAIN}", file=sys.stderr)
        for error in result.errors:
            print(f"{_RED} * {_in_one_line(error)}{_PLAIN}", file=sys.stderr)
        if result.skipped:
            skipped = ", ".join(f"{name} (needs {culprit})" for name, culprit in result.skipped.items())
            print(f"{_RED}   skipped: {skipped}{_PLAIN}", file=sys.stderr)
        print(f'{_RED}Invoking "catkin_make" failed{_PLAIN}', file=sys.stderr)
        return 1
    if result.unchanged and not result.built and not has_more_to_do:
        count = len(result.unchanged)
        print(f"Nothing has changed: {count} package{'s are' if count > 1 else ' is'} up to date")
    return 0


def _clean(layout: WorkspaceFolders) -> int:
    """Remove the built files, like `make clean`. The setup files and the install space are kept."""
    for folder in (
        layout.build / "pipros",
        layout.devel / "bin",
        layout.devel / "lib",
        layout.devel / "include",
        layout.devel / "share",
    ):
        shutil.rmtree(folder, ignore_errors=True)
    return 0


def _print_line(line: str) -> None:
    print(line, flush=True)


if __name__ == "__main__":
    sys.exit(main())
