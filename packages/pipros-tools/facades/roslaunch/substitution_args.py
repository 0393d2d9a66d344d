"""`resolve_args`, which replaces substitution arguments such as `$(arg x)`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipros.basics.errors import NotFound
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.param_types import convert
from pipros_tools.launch.substitute import Substitution, SubstitutionError, UnsetArgument, anonymous_name
from pipros_workspace.index import PackageIndex

if TYPE_CHECKING:
    from rospkg import RosPack

SubstitutionException = SubstitutionError
ArgException = UnsetArgument

__all__ = ["ArgException", "SubstitutionException", "convert_value", "resolve_args"]

_rospack: RosPack | None = None
"""Replaceable package finder. Other packages assign a new one to discard cached results."""


def convert_value(value: str, type_: str) -> Any:
    """Convert text to a parameter value. `type_` is auto, str, int, double, bool or yaml.

    Raises:
        ValueError: the type is unknown, or the text is not valid for the type.
    """
    return convert(value, type_)


def resolve_args(
    arg_str: str,
    context: Mapping[str, Any] | None = None,
    resolve_anon: bool = True,
    filename: str | None = None,
) -> str:
    """Return the text with all substitutions applied.

    Args:
        context: `{"arg": {name: value}, "filename": path}`, as in Noetic; it also stores anonymous names.
        resolve_anon: has no effect, as in Noetic. `$(anon x)` becomes a unique name in any case.
        filename: the file that contains the text, for `$(dirname)`.

    Raises:
        SubstitutionException, ExpressionError: the text is malformed, or a name in it is unknown.
        rospkg.ResourceNotFound: a package does not exist.
    """
    _ = resolve_anon
    if not arg_str:
        return arg_str
    context = {} if context is None else context
    file = filename or context.get("filename")
    substitution = Substitution(
        LoadContext.of_process(_packages()).find,
        os.environ,
        anonymous_name,
        arguments=dict(context.get("arg", {})),
        folder=os.path.dirname(os.path.abspath(file)) if file else None,
        anonymous=context.get("anon", {}),
    )
    if isinstance(context, dict):
        context.setdefault("anon", substitution.anonymous)
    try:
        return substitution.resolve(arg_str)
    except NotFound as error:
        from rospkg import ResourceNotFound  # this module is slow to import and rarely needed

        raise ResourceNotFound(str(error)) from error


def _packages() -> PackageIndex | None:
    """Return the packages that `_rospack` finds, or None if it is not set."""
    return None if _rospack is None else PackageIndex([Path(path) for path in _rospack.get_ros_paths()])
