"""`catkin_make_isolated`: builds the packages in a workspace one by one."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.make_args import read_make_arguments
from pipros_workspace.build_options import BuildOptions
from pipros_workspace.isolated import IsolatedOptions, IsolatedResult, build_isolated
from pipros_workspace.layout import (
    WORKSPACE_MARKER,
    SourcePackage,
    WorkspaceError,
    WorkspaceFolders,
    closure,
    read_source_space,
)

_COLLECTING = ("--cmake-args", "--make-args", "--catkin-make-args")
_RULE = "~" * 47


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Build the packages. Return the exit code, which is 1 if a package failed."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    options = _parse(arguments)
    try:
        layout = _layout(options)
        print("\n".join(_spaces(layout)))
        if options.cmake_args:
            print(f"Additional CMake Arguments: {' '.join(options.cmake_args)}")
        space = read_source_space(layout.source, os.environ)
        if space.errors:
            raise WorkspaceError("\n".join(space.errors))
        if not space.packages:
            print(f"No packages found in source space: {layout.source}")
        (layout.base / WORKSPACE_MARKER).touch()
        packages, chosen = _choose(space.packages, options)
        print(_RULE)
        print(f"~~  traversing {len(packages)} packages in topological order:")
        for package in packages:
            print(f"~~  - {package.name}{' (metapackage)' if package.is_metapackage else ''}")
        print(_RULE, flush=True)
        result = build_isolated(layout, packages, chosen, _build_options(options), _print_line, os.environ)
    except (PiprosError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    return _end(result)


def _end(result: IsolatedResult) -> int:
    for error in result.errors:
        print(error, file=sys.stderr)
    if result.errors:
        print("Command failed, exiting.", file=sys.stderr)
        return 1
    return 0


def _parse(arguments: Sequence[str]) -> Namespace:
    parser = ArgumentParser(
        prog="catkin_make_isolated",
        description="Builds each catkin package of a workspace in isolation, but still in topological order. "
        "If a package needs CMake, genuine catkin builds it, if installed.",
    )
    add = parser.add_argument
    add(
        "-C",
        "--directory",
        default=".",
        metavar="WORKSPACE",
        help="The base path of the workspace (default '.')",
    )
    add("--source", "--source-space", help="The path to the source space (default 'workspace_base/src')")
    add(
        "--build",
        "--build-space",
        help="The path to the build space (default 'workspace_base/build_isolated')",
    )
    add(
        "--devel",
        "--devel-space",
        help="Sets the target devel space (default 'workspace_base/devel_isolated')",
    )
    add("--merge", action="store_true", help="Build each catkin package into a common devel space.")
    add("--install-space", help="Sets the target install space (default 'workspace_base/install_isolated')")
    for tool in ("ninja", "nmake", "gmake"):
        add(f"--use-{tool}", action="store_true", help="Accepted for compatibility with Noetic; make is used")
    add("--install", action="store_true", help="Causes each catkin package to be installed.")
    add("--force-cmake", action="store_true", help="Accepted for compatibility with Noetic; has no effect")
    add("--no-color", action="store_true", help="Disables colored output")
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument(
        "--pkg", nargs="+", default=[], metavar="PKGNAME", help="Process only specific packages"
    )
    choice.add_argument(
        "--ignore-pkg", nargs="+", default=[], metavar="PKGNAME", help="Ignore specific packages."
    )
    choice.add_argument("--from-pkg", metavar="PKGNAME", help="Continue with the given package")
    add(
        "--only-pkg-with-deps",
        nargs="+",
        default=[],
        help="Only consider the specific packages and their recursive dependencies (only together with "
        "--merge or --install)",
    )
    add("-q", "--quiet", action="store_true", help="Suppresses the output until an error occurs.")
    for option in _COLLECTING:
        add(
            option,
            nargs="*",
            default=[],
            help="Collects the arguments that follow. Only -DNAME=VALUE for CMake and -j and -l for make "
            "have an effect",
        )
    add("--override-build-tool-check", action="store_true", help="Accepted for compatibility with Noetic")
    remaining, collected = _split(arguments)
    options = parser.parse_args(remaining)
    options.cmake_args = collected["--cmake-args"]
    options.make_args = collected["--make-args"]
    if options.only_pkg_with_deps and not (options.merge or options.install):
        parser.error("The --only-pkg-with-deps option can only be used together with --merge or --install")
    return options


def _split(arguments: Sequence[str]) -> tuple[list[str], dict[str, list[str]]]:
    """Return the command's own arguments, and the arguments after each option such as `--cmake-args`.

    Such an option takes all arguments up to the next such option. Job options such as `-j4` before the first
    one count as arguments for make.
    """
    remaining: list[str] = []
    collected: dict[str, list[str]] = {option: [] for option in _COLLECTING}
    current = remaining
    for word in arguments:
        if word in collected:
            current = collected[word]
        elif current is remaining and (word.startswith(("-j", "-l")) and word[2:].isdecimal()):
            collected["--make-args"].append(word)
        else:
            current.append(word)
    return remaining, collected


def _layout(options: Namespace) -> WorkspaceFolders:
    base = Path(options.directory).absolute()
    if not base.is_dir():
        raise WorkspaceError(f"Workspace path '{base}' does not exist.")
    # As in Noetic, paths given for the spaces are relative to the working directory.
    layout = WorkspaceFolders(
        base,
        Path(options.source).absolute() if options.source else base / "src",
        Path(options.build).absolute() if options.build else base / "build_isolated",
        Path(options.devel).absolute() if options.devel else base / "devel_isolated",
        Path(options.install_space).absolute() if options.install_space else base / "install_isolated",
    )
    if not layout.source.is_dir():
        raise WorkspaceError(f"Could not find source space: {layout.source}")
    return layout


def _spaces(layout: WorkspaceFolders) -> list[str]:
    return [
        f"Base path: {layout.base}",
        f"Source space: {layout.source}",
        f"Build space: {layout.build}",
        f"Devel space: {layout.devel}",
        f"Install space: {layout.install}",
    ]


def _choose(
    packages: Sequence[SourcePackage], options: Namespace
) -> tuple[list[SourcePackage], list[SourcePackage]]:
    """Return the packages to traverse, and the subset to build.

    Raises:
        WorkspaceError: a requested package is not in the workspace, or `--from-pkg` is not to be built.
    """
    names = [package.name for package in packages]
    named = [*options.pkg, *options.only_pkg_with_deps, *filter(None, [options.from_pkg])]
    missing = [name for name in named if name not in names]
    if missing:
        raise WorkspaceError(f"Packages not found in the workspace: {', '.join(missing)}")
    if options.only_pkg_with_deps:
        needed = closure(packages, set(options.only_pkg_with_deps))
        packages = [package for package in packages if package.name in needed]
    packages = [package for package in packages if package.name not in options.ignore_pkg]
    chosen = packages
    if options.pkg:
        chosen = [package for package in packages if package.name in options.pkg]
    elif options.from_pkg:
        names = [package.name for package in packages]
        if options.from_pkg not in names:
            raise WorkspaceError(f"--from-pkg {options.from_pkg} is not among the packages to build")
        chosen = packages[names.index(options.from_pkg) :]
    return list(packages), list(chosen)


def _build_options(options: Namespace) -> IsolatedOptions:
    settings = (word[2:].partition("=") for word in options.cmake_args if word.startswith("-D"))
    definitions = {name.partition(":")[0]: value for name, sign, value in settings if sign}
    return IsolatedOptions(
        merges=options.merge,
        is_quiet=options.quiet,
        build=BuildOptions(
            definitions=definitions,
            installs=options.install,
            jobs=read_make_arguments(options.make_args).jobs,
        ),
    )


def _print_line(line: str) -> None:
    print(line, flush=True)


if __name__ == "__main__":
    sys.exit(main())
