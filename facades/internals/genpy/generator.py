"""`genpy.generator`: parts of the Python generator that tools use; see `pipros.msg.generated_parts`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from genmsg import InvalidMsgSpec as InvalidMsgSpec
from genmsg import MsgContext as MsgContext
from genmsg import MsgGenerationException as MsgGenerationException
from genmsg import MsgSpec as MsgSpec
from genmsg import log as log
from genmsg.gentools import compute_full_text
from genpy.base import SIMPLE_TYPES as SIMPLE_TYPES
from genpy.base import is_simple as is_simple
from pipros.basics.lazy_names import star_names as _star_names
from pipros.msg import generated_parts as _parts
from pipros.msg.generated_parts import Special as Special

_star_names(__name__, "errno genmsg keyword os struct sys traceback")

INDENT = "  "

T = TypeVar("T")


def _generated(function: Callable[..., T], *args: Any) -> T:
    try:
        return function(*args)
    except _parts.GenerationError as error:
        raise MsgGenerationException(str(error)) from None


def get_registered_ex(msg_context: MsgContext, type_: str) -> MsgSpec:
    """Return the specification of a type.

    Raises:
        MsgGenerationException: the type is not registered.
    """
    found: MsgSpec = _generated(_parts.registered, msg_context, type_)
    return found


def is_special(type_: str) -> bool:
    """Return True for the types that are not generated: `time`, `duration` and `Header`."""
    return _parts.is_special(type_)


def get_special(type_: str) -> Special | None:
    """Return the substitute for a type that is not generated, or None for other types."""
    return _parts.special(type_)


def compute_post_deserialize(type_: str, varname: str) -> str | None:
    """Return the code to run after a variable is deserialized, such as `x.canon()`, or None."""
    special = get_special(type_)
    return None if special is None else special.get_post_deserialize(varname)


def compute_constructor(msg_context: MsgContext, package: str, type_: str) -> str | None:
    """Return the expression that creates a message or a time, or None for numbers, strings and arrays."""
    return _generated(_parts.constructor, msg_context, package, type_)


def compute_import(msg_context: MsgContext, package: str, type_: str) -> list[str]:
    """Return the imports for the generated code of a field. Raises the same errors as `get_registered_ex`."""
    return _generated(_parts.imports, msg_context, package, type_)


def compute_pkg_type(package: str, type_: str) -> tuple[str, str]:
    """Return the package and name of a type that a definition in `package` refers to.

    Raises:
        MsgGenerationException: the type has more than one slash.
    """
    return _generated(_parts.package_and_name, package, type_)


def default_value(msg_context: MsgContext, field_type: str, default_package: str) -> str | None:
    """Return the expression for the default value of a field."""
    return _generated(_parts.default_value, msg_context, field_type, default_package)


def make_python_safe(spec: MsgSpec) -> MsgSpec:
    """Return a copy of a specification with an underscore appended to names that are Python keywords."""
    safe: MsgSpec = _parts.without_keywords(spec)
    return safe


def flatten(msg_context: MsgContext, msg: MsgSpec) -> MsgSpec:
    """Return a specification with embedded messages replaced by their fields, such as `header.seq`.

    Raises:
        MsgGenerationException: an embedded type is not registered.
    """
    fields = _generated(lambda: list(_parts.flattened(msg_context, msg)))
    names = [name for _, name in fields]
    return MsgSpec([kind for kind, _ in fields], names, msg.constants, msg.text, msg.full_name)


def compute_struct_pattern(types: Sequence[str] | None) -> str | None:
    """Return the `struct` format characters for types, or None if a type is not a number."""
    return _parts.struct_pattern(types)


def reduce_pattern(pattern: str) -> str:
    """Return a `struct` format with counts for repeated characters."""
    return _parts.reduced_pattern(pattern)


def compute_resource_name(filename: str, ext: str) -> str:
    """Return the name of the type defined by a file."""
    return _parts.resource_name(filename, ext)


def compute_outfile_name(outdir: str, infile_name: str, ext: str) -> str:
    """Return the path of the module generated for a definition file."""
    return _parts.outfile_name(outdir, infile_name, ext)


def compute_full_text_escaped(msg_context: MsgContext, spec: MsgSpec) -> str:
    """Return the full text of a definition, escaped for a triple-quoted Python string."""
    return compute_full_text(msg_context, spec).replace('"""', r"\"\"\"")
