"""`pipros install`: builds ROS packages, and installs them and their dependencies with pip or uv."""

from __future__ import annotations

import sys
import tempfile
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros_tools.cli.entry_point import command

if TYPE_CHECKING:
    from pipros_wheels.plan import PlanStep


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Install the packages. Return the exit code, which is 1 if something failed."""
    arguments = _parser().parse_args(argv)
    try:
        with tempfile.TemporaryDirectory(prefix="pipros-install-") as folder:
            return _install(arguments, Path(folder))
    except (PiprosError, OSError) as error:
        print(f"pipros install: {error}", file=sys.stderr)
        return 1


def _parser() -> ArgumentParser:
    parser = ArgumentParser(
        prog="pipros install",
        description="Builds the packages in folders, git repositories and lists of repositories, and "
        "installs them and the dependencies in their package.xml files into the running environment.",
    )
    parser.add_argument("sources", nargs="+", metavar="PATH|GIT-URL|FILE.rosinstall|FILE.repos")
    parser.add_argument("-n", "--dry-run", action="store_true", help="print the plan, and do nothing")
    parser.add_argument(
        "-f",
        "--find-links",
        type=Path,
        action="append",
        default=[],
        metavar="FOLDER",
        help="a folder of wheels",
    )
    parser.add_argument("--index-url", default="", metavar="URL", help="the only index to use")
    parser.add_argument("--no-index", action="store_true", help="use only folders of wheels")
    parser.add_argument("--keys", metavar="FILE", help="YAML file that maps rosdep keys to requirements")
    parser.add_argument("--installer", choices=("pip", "uv"), default="", help="default: pip, or else uv")
    parser.add_argument("--strict", action="store_true", help="fail if a package has compiled targets")
    parser.add_argument("--whole", action="store_true", help="add each package's folder as a whole")
    return parser


def _install(arguments: Namespace, folder: Path) -> int:
    from pipros_wheels.folder_wheels import split_requirement
    from pipros_wheels.installer import Installer, find_installer
    from pipros_wheels.plan import Places, Provider, make_plan, plan_table
    from pipros_wheels.python_keys import read_keys
    from pipros_wheels.sources import source_folders
    from pipros_wheels.wheel_build import WheelOptions, build_wheels, source_packages

    for name in ("clones", "wheels"):
        (folder / name).mkdir()
    keys = read_keys(arguments.keys)
    space = source_packages(source_folders(arguments.sources, folder / "clones"))
    places = tuple(item.resolve() for item in arguments.find_links)
    words = find_installer(arguments.installer)
    installer = Installer(words, places, arguments.index_url, arguments.no_index)
    has_in_index = installer.has_wheel if arguments.index_url and not arguments.no_index else None
    errors = space.errors
    plan = make_plan(space.packages, Places(places, has_in_index, keys), errors)
    print("\n".join(plan_table(plan)))
    _print_advice(plan)
    if not arguments.dry_run:
        options = WheelOptions(arguments.strict, arguments.whole, keys=keys, folders=places)
        build = build_wheels(space.packages, folder / "wheels", options, _print_line)
        errors += build.errors
        for wheel in build.wheels:
            for note in wheel.notes:
                print(f"{wheel.package.name}: {note}")
        for line in [*build.missing(), *build.left_out]:
            print(line)
        files = {wheel.file: "" for wheel in build.wheels}
        files |= {step.wheel.file: step.wheel.sha256 for step in plan if step.wheel}
        indexed = [step.target for step in plan if step.provider is Provider.INDEX]
        more = [step.target for step in plan if step.provider is Provider.PYPI]
        if build.wheels:
            only_wheels = [split_requirement(text)[0] for text in indexed]
            installer.install(list(dict.fromkeys([*indexed, *more])), files, only_wheels)
    for error in errors:
        print(f"pipros install: {error}", file=sys.stderr)
    return 1 if errors else 0


def _print_advice(plan: Sequence[PlanStep]) -> None:
    from pipros_wheels.plan import Provider

    debian = sorted({step.target for step in plan if step.provider is Provider.DEBIAN})
    if debian:
        print(f"Not installed, because it needs root: apt-get install {' '.join(debian)}")
    unknown = [step.name for step in plan if step.provider is Provider.UNKNOWN]
    if unknown:
        print(f"Unknown, and not installed: {' '.join(unknown)}. Name their PyPI projects with --keys FILE")


def _print_line(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
