"""`rosmaster.validators`: validation of the arguments of API calls."""

from __future__ import annotations

from pipros.net.argument_checks import ANY_TYPE as ANYTYPE
from pipros.net.argument_checks import (
    ParameterInvalid,
    empty_or_valid_name,
    global_name,
    non_empty,
    not_none,
    valid_name,
)
from pipros.net.argument_checks import api_uri as is_api
from pipros.net.argument_checks import below_root as is_service
from pipros.net.argument_checks import below_root as is_topic
from pipros.net.argument_checks import non_empty_text as non_empty_str
from pipros.net.argument_checks import resolved_name as valid_name_validator_resolved
from pipros.net.argument_checks import type_name as valid_type_name
from pipros.net.argument_checks import unresolved_name as valid_name_validator_unresolved
from rosgraph.names import resolve_name

__all__ = [
    "ANYTYPE",
    "ROSRPC",
    "TYPE_SEPARATOR",
    "ParameterInvalid",
    "empty_or_valid_name",
    "global_name",
    "is_api",
    "is_service",
    "is_topic",
    "isstring",
    "non_empty",
    "non_empty_str",
    "not_none",
    "resolve_name",
    "valid_name",
    "valid_name_validator_resolved",
    "valid_name_validator_unresolved",
    "valid_type_name",
]

TYPE_SEPARATOR = "/"
ROSRPC = "rosrpc://"


def isstring(s: object) -> bool:
    """Return whether an object is a string."""
    return isinstance(s, str)
