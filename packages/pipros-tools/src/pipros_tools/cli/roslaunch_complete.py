"""`roslaunch-complete`: prints the arguments that a launch file accepts, for shell completion."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.errors import PiprosError
from pipros.basics.names import without_launch_arguments
from pipros_tools.cli.entry_point import command


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Print the names of the settable arguments on one line. Return 1 silently if the file cannot be read."""
    words = without_launch_arguments(sys.argv[1:] if argv is None else argv)
    from pipros_tools.launch.find_launch_files import resolve_files
    from pipros_tools.launch.load_context import LoadContext
    from pipros_tools.launch.xml import load
    from pipros_workspace.index import PackageIndex

    index = PackageIndex.from_environment()
    try:
        files = resolve_files(words[:2], index)[:1]  # later words may be incomplete
        launch = load(
            files,
            {},
            context=LoadContext.of_process(index).without_commands(),
            unset_as="",
            arguments_only=True,
        )
    except PiprosError:
        return 1
    settable = [
        argument.name for argument in launch.arguments if argument.is_required or argument.default is not None
    ]
    print(" ".join(sorted(settable)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
