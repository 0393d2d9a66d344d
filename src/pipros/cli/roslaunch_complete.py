"""`roslaunch-complete`: the arguments that a launch file takes, for shells that complete command lines."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.errors import PiprosError
from pipros.cli.streams import command


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Prints the names on one line and returns 0. A file that cannot be read is 1, without a word."""
    words = list(sys.argv[1:] if argv is None else argv)
    from pipros.launch.find_launch_files import resolve_files
    from pipros.launch.load_context import LoadContext
    from pipros.launch.xml import load
    from pipros.workspace.index import PackageIndex

    index = PackageIndex.from_environment()
    try:
        files = resolve_files(words[:2], index)[:1]  # what follows may be incomplete as yet
        launch = load(files, {}, context=LoadContext.of_process(index), unset_as="", arguments_only=True)
    except PiprosError:
        return 1
    settable = [
        argument.name for argument in launch.arguments if argument.is_required or argument.default is not None
    ]
    print(" ".join(sorted(settable)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
