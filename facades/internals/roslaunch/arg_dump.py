"""The arguments of launch files, with their documentation and default values."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.lazy_names import star_names as _star_names
from pipros.launch.inspect import arguments_text
from pipros.launch.model import Argument
from roslaunch.config import load_config_default
from roslaunch.core import FileAndArguments, RLException
from roslaunch.xmlloader import XmlLoader

__all__ = ["RLException", "dump_args", "get_args", "load_config_default"]

_star_names(__name__, "roslaunch sys")


def get_args(roslaunch_files: Sequence[FileAndArguments]) -> dict[str, tuple[str | None, str | None]]:
    """Return the documentation and the default value of each argument in the last file.

    Raises:
        RLException: a file is invalid. The message names the file, line and element.
    """
    loader = XmlLoader(resolve_anon=False, args_only=True)
    load_config_default(roslaunch_files, None, loader=loader, assign_machines=False)
    return {} if loader.root_context is None else dict(loader.root_context.resolve_dict["arg_doc"])


def dump_args(roslaunch_files: Sequence[FileAndArguments]) -> None:
    """Print the arguments of the last file. Exit with code 1 if a file is invalid."""
    try:
        found = get_args(roslaunch_files)
    except RLException as error:
        print(error, file=sys.stderr)
        sys.exit(1)
    print(arguments_text(Argument(name, default, doc=doc or "") for name, (doc, default) in found.items()))
