"""`rosversion`: prints the version of a package, or the name of the distribution."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Sequence

from pipros.packages.crawl import STACKS
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import run
from pipros_workspace.index import Package, PackageIndex

DISTRO = "noetic"
"""The distribution that pipros follows. `ROS_DISTRO` overrides the name."""

UNKNOWN_VERSION = "<unversioned>"


@command
def main(argv: Sequence[str] | None = None) -> int:
    parser = ArgumentParser(
        prog="rosversion",
        usage="rosversion [-h] [-s] [-d] [-a] [package]",  # Python 3.14 would format the usage differently
        formatter_class=RawDescriptionHelpFormatter,
        description="rosversion -d: Output the version of the given package\n"
        "rosversion package: Output the ROS distribution name",
    )
    parser.add_argument(
        "-s", "--skip-newline", action="store_true", help="Skip trailing newline", dest="skip_newline"
    )
    choice = parser.add_mutually_exclusive_group(required=True)
    choice.add_argument("package", nargs="?", help="The ROS package name (e.g. 'roscpp')")
    choice.add_argument("-d", "--distro", action="store_true", help="Output the ROS distribution name")
    choice.add_argument(
        "-a", "--all", action="store_true", help="Show all ROS package names and their versions"
    )
    options = parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    end = "" if options.skip_newline else "\n"

    def body() -> int:
        if options.distro:
            print(os.environ.get("ROS_DISTRO") or DISTRO, end=end)
            return 0
        index = PackageIndex.from_environment()
        if options.all:
            print("\n".join(f"{package.name}: {version_of(package)}" for package in index), end=end)
            return 0
        package = index.get(options.package)
        if package is None:
            package = PackageIndex.from_environment(kinds=STACKS).get(options.package)
        if package is None:
            print(f"Cannot locate [{options.package}]")
            return 1
        print(version_of(package), end=end)
        return 0

    return run(body)


def version_of(package: Package) -> str:
    """Return the version in the package's manifest.

    Raises:
        XmlError: the manifest is malformed.
    """
    from pipros_workspace.manifest import read_manifest

    return read_manifest(package.path).version or UNKNOWN_VERSION
