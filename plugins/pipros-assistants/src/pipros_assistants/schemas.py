"""Describe in words which values a schema of the tools allows."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

_KINDS: Final = {
    "array": "a list of {} to {} items",
    "boolean": "true or false",
    "integer": "a whole number from {} to {}",
    "number": "a number from {} to {}",
    "object": "an object",
    "string": "a text of {} to {} characters",
}
_LEAST: Final = ("minimum", "exclusiveMinimum", "minLength", "minItems")
_MOST: Final = ("maximum", "maxLength", "maxItems")


def required(schema: Mapping[str, Any]) -> str:
    """Return which values a schema of a tool allows.

    >>> required({"type": "number", "minimum": 0.1, "maximum": 30.0})
    'a number from 0.1 to 30'
    >>> required({"enum": ["info", "warn"], "type": "string"})
    'one of info, warn'
    >>> required({"anyOf": [{"type": "boolean"}, {"type": "string", "maxLength": 9}]})
    'true or false, or a text of 0 to 9 characters'
    >>> required({"type": "integer"})
    'a whole number'
    """
    if "anyOf" in schema:
        return ", or ".join(map(required, schema["anyOf"]))
    if "enum" in schema:
        return f"one of {', '.join(map(str, schema['enum']))}"
    least = next((schema[key] for key in _LEAST if key in schema), 0)
    most = next((schema[key] for key in _MOST if key in schema), None)
    kind = _KINDS[schema["type"]]
    return re.sub(" (from|of) .*", "", kind) if most is None else kind.format(f"{least:.12g}", f"{most:.12g}")
