"""`genpy.base`: which types are one number on the wire."""

from pipros.msg.language.spec import NUMBERS

SIMPLE_TYPES = list(NUMBERS)
SIMPLE_TYPES_DICT = {**NUMBERS, "bool": "B"}


def is_simple(type_: str) -> bool:
    return type_ in NUMBERS
