"""`roslaunch.arg_dump`: the arguments of launch files, as printed by `roslaunch --ros-args`."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.basics.errors import PiprosError
from pipros_tools.launch.inspect import arguments_text
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.model import Argument
from pipros_tools.launch.xml import load
from pipros_workspace.index import PackageIndex
from roslaunch.config import load_config_default as load_config_default
from roslaunch.core import RLException


def get_args(roslaunch_files: Sequence[str]) -> dict[str, tuple[str | None, str | None]]:
    """Return the documentation and the default, or None, of each argument without a fixed value.

    Raises:
        RLException: a file cannot be read.
    """
    return {each.name: (each.doc, each.default) for each in _arguments(roslaunch_files) if not each.value}


def dump_args(roslaunch_files: Sequence[str]) -> None:
    """Print the arguments."""
    print(arguments_text(_arguments(roslaunch_files)))


def _arguments(files: Sequence[str]) -> tuple[Argument, ...]:
    context = LoadContext.of_process(PackageIndex.from_environment())
    try:
        return load(files, context=context, unset_as="", arguments_only=True).arguments
    except PiprosError as error:
        raise RLException(str(error)) from None
