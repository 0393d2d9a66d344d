"""`resolve_args`: makes substitutions in a text."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from pipros.launch.substitute import Substitution, SubstitutionError, UnsetArgument, anonymous_name
from pipros.launch.surroundings import Surroundings

SubstitutionException = SubstitutionError
ArgException = UnsetArgument

__all__ = ["ArgException", "SubstitutionException", "resolve_args"]


def resolve_args(
    arg_str: str,
    context: Mapping[str, Any] | None = None,
    resolve_anon: bool = True,
    filename: str | None = None,
) -> str:
    """The text with all substitutions made.

    Args:
        context: `{"arg": {name: value}}`, as Noetic has it; the anonymous names made are kept in it.

    Raises:
        SubstitutionException: for what is malformed or does not exist.
    """
    _ = resolve_anon
    if not arg_str:
        return arg_str
    context = {} if context is None else context
    file = filename or context.get("filename")
    here = Surroundings.here()
    substitution = Substitution(
        here.find,
        os.environ,
        anonymous_name,
        arguments=dict(context.get("arg", {})),
        folder=os.path.dirname(os.path.abspath(file)) if file else None,
        anonymous=context.get("anon", {}),
    )
    if isinstance(context, dict):
        context.setdefault("anon", substitution.anonymous)
    return substitution.resolve(arg_str)
