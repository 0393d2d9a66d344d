"""`pipros wheel`: builds wheels of ROS packages."""

from __future__ import annotations

import sys
import tempfile
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros_tools.cli.entry_point import command


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Build the wheels, or write the `pyproject.toml` files. Return the exit code: 1 after an error."""
    parser = ArgumentParser(
        prog="pipros wheel",
        description="Builds a wheel for each package in folders, workspaces and git repositories.",
    )
    parser.add_argument("sources", nargs="*", metavar="DIR|GIT-URL", help="default: the working directory")
    parser.add_argument(
        "-o", "--output", type=Path, default=Path("dist"), metavar="OUT", help="default: dist"
    )
    parser.add_argument("--strict", action="store_true", help="fail if a package has compiled targets")
    parser.add_argument("--whole", action="store_true", help="add each package's folder as a whole")
    parser.add_argument("--keys", metavar="FILE", help="YAML file that maps rosdep keys to requirements")
    parser.add_argument(
        "--init", action="store_true", help="write the pyproject.toml files that pip install . needs"
    )
    parser.add_argument(
        "--ros2",
        choices=("jazzy", "kilted"),
        help="build wheels for rclpy with the packages' messages, services and actions; DIR may also be the "
        "name of a package, such as tf2_msgs or example_interfaces",
    )
    arguments = parser.parse_args(argv)
    if arguments.ros2:
        return _build_for_ros2(arguments)
    from pipros_wheels.init_file import ADVICE, write_build_system
    from pipros_wheels.python_keys import read_keys
    from pipros_wheels.sources import source_folders
    from pipros_wheels.wheel_build import WheelOptions, build_wheels, source_packages

    try:
        with tempfile.TemporaryDirectory(prefix="pipros-sources-") as clones:
            space = source_packages(source_folders(arguments.sources or ["."], Path(clones)))
            if arguments.init:
                for package in space.packages:
                    print(write_build_system(package.folder))
                print(ADVICE)
                return _report(space.errors)
            options = WheelOptions(
                is_strict=arguments.strict, is_whole=arguments.whole, keys=read_keys(arguments.keys)
            )
            build = build_wheels(space.packages, arguments.output, options, _print_line)
            for wheel in build.wheels:
                for note in wheel.notes:
                    print(f"{wheel.package.name}: {note}")
                print(wheel.file)
            for line in [*build.missing(), *build.left_out]:
                print(line)
            nothing = [] if build.wheels or space.errors or build.errors else ["no wheel was built"]
            return _report([*space.errors, *build.errors, *nothing])
    except (PiprosError, OSError) as error:
        return _report([str(error)])


def _build_for_ros2(arguments: Namespace) -> int:
    from pipros_wheels.ros2_wheel import Ros2Wheels
    from pipros_wheels.wheel_build import source_packages
    from pipros_workspace.layout import SourceSpace

    names = [word for word in arguments.sources if not Path(word).is_dir()]
    folders = [Path(word) for word in arguments.sources if Path(word).is_dir()]
    try:
        space = SourceSpace([], []) if names and not folders else source_packages(folders or [Path()])
        wheels = Ros2Wheels(
            arguments.ros2,
            {package.name: package.folder for package in space.packages},
            arguments.output,
            _print_line,
        )
        for file in wheels.build([*(package.name for package in space.packages), *names]):
            print(file)
        return _report(space.errors)
    except (PiprosError, OSError) as error:
        return _report([str(error)])


def _report(errors: Sequence[str]) -> int:
    for error in errors:
        print(f"pipros wheel: {error}", file=sys.stderr)
    return 1 if errors else 0


def _print_line(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
