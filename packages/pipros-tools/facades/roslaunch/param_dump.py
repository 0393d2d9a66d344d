"""`roslaunch.param_dump`: the parameters of launch files, as printed by `roslaunch --dump-params`."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.errors import PiprosError
from pipros_tools.launch.inspect import params_text
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.xml import load
from pipros_workspace.index import PackageIndex


def dump_params(files: Sequence[str]) -> bool:
    """Print the parameters as YAML. If a file cannot be read, print the reason, and return False."""
    context = LoadContext.of_process(PackageIndex.from_environment())
    try:
        print(params_text(load(files, context=context, unset_as="").params))
    except PiprosError as error:
        print(f"Unable to load file {', '.join(files)}: {error}", file=sys.stderr)
        return False
    return True
