"""`roslaunch-deps`: prints the packages that launch files need and, with `-w`, undeclared packages."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from optparse import OptionParser
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.basics.names import without_launch_arguments
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import add_flag
from pipros_tools.launch.check import needed_packages
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.model import Launch
from pipros_tools.launch.xml import load
from pipros_workspace.index import PackageIndex
from pipros_workspace.manifest import read_manifest


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Print the packages and, if `-w` is given, the undeclared packages. Return 1 only on errors."""
    parser = OptionParser(usage="usage: %prog [options] <file(s)...>", prog="roslaunch-deps")
    add_flag(parser, "-v", "--verbose", help="Verbose output")
    add_flag(parser, "-w", "--warn", help="Warn about missing manifest dependencies")
    options, files = parser.parse_args(without_launch_arguments(sys.argv[1:] if argv is None else argv))
    if not files:
        parser.error("please specify a launch file")
    missing = [file for file in files if not Path(file).is_file()]
    if missing:
        parser.error(f"cannot locate {','.join(missing)}")
    index = PackageIndex.from_environment()
    owners = {owner.name: owner for owner in (index.containing(Path(file)) for file in files) if owner}
    if len(owners) > 1:
        print(f"roslaunch files must be in the same package: {' vs. '.join(sorted(owners))}", file=sys.stderr)
        return 1
    try:
        launch = load(files, context=LoadContext.of_process(index).without_commands(), unset_as="")
    except PiprosError as error:
        print(error, file=sys.stderr)
        return 1
    if options.verbose:
        _explain(launch)
    needed = sorted(needed_packages(launch, index) - owners.keys())
    if not options.warn:
        print(" ".join(needed))
        return 0
    print(f"Dependencies:\n{' '.join(needed)}\n")
    for name, owner in owners.items():
        undeclared = [package for package in needed if package not in read_manifest(owner.path).depends()]
        if undeclared:
            print("Missing declarations:")
            print(f"{name}/package.xml:")
            for package in undeclared:
                print(f"  <exec_depend>{package}</exec_depend>")
    return 0


def _explain(launch: Launch) -> None:
    for file in launch.files:
        print(f"processing launch {file}")
    for node in (*launch.nodes, *(test.node for test in launch.tests)):
        print(f"{node.package} [{node.package}/{node.type}]")
    print("-" * 80)


if __name__ == "__main__":
    sys.exit(main())
