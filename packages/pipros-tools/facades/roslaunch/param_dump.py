"""`roslaunch.param_dump`: the parameters of launch files, as printed by `roslaunch --dump-params`."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.errors import PiprosError
from pipros.basics.lazy_names import star_names as _star_names
from pipros.launch.inspect import params_text
from pipros.launch.load_context import LoadContext
from pipros.launch.xml import load
from pipros.workspace.index import PackageIndex

_star_names(__name__, "roslaunch sys yaml")


def dump_params(files: Sequence[str]) -> bool:
    """Print the parameters as YAML. If a file cannot be read, print the reason, and return False."""
    context = LoadContext.of_process(PackageIndex.from_environment())
    try:
        print(params_text(load(files, context=context, unset_as="").params))
    except PiprosError as error:
        print(f"Unable to load file {', '.join(files)}: {error}", file=sys.stderr)
        return False
    return True
