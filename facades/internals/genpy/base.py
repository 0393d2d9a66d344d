"""`genpy.base`: the types that are serialized as a single number."""

from pipros.msg.generated_parts import SIMPLE as SIMPLE_TYPES_DICT
from pipros.msg.generated_parts import is_simple

__all__ = ["SIMPLE_TYPES", "SIMPLE_TYPES_DICT", "is_simple"]

SIMPLE_TYPES = list(SIMPLE_TYPES_DICT)
