"""Messages of any class with random values."""

import random
import struct
from typing import Any

from pipros.msg.language.spec import INTEGERS, NUMBERS, OCTETS
from pipros.msg.time import Duration, Time
from pipros_workspace.index import SHIPPED_FOLDERS

_STRINGS = ["", "a", "base_link", "ünïcode \N{PILE OF POO}", 'quotes " and \\', "line\nbreak\t\0"]


def shipped_types() -> list[str]:
    """Return all message types that are shipped with pipros, sorted."""
    return sorted(
        f"{file.parent.parent.name}/{file.stem}"
        for share in SHIPPED_FOLDERS
        for file in share.glob("*/msg/*.msg")
    )


def fill_at_random(message: Any, rng: random.Random, *, finite: bool = False) -> Any:
    """Set all fields of a new message to random values, and return it.

    `finite` excludes infinity and NaN from the choice of special values.
    """
    for slot, kind in zip(message.__slots__, message._slot_types, strict=True):
        base, bracket, digits = kind.rstrip("]").partition("[")
        count = int(digits) if digits else rng.randint(0, 3)
        if not bracket:
            setattr(message, slot, _single(base, rng, finite, getattr(message, slot)))
        elif base in OCTETS:
            setattr(message, slot, rng.randbytes(count))
        else:
            setattr(message, slot, [_single(base, rng, finite, None) for _ in range(count)])
    return message


def _single(base: str, rng: random.Random, finite: bool, present: Any) -> Any:
    if base in INTEGERS:
        code = INTEGERS[base]
        return struct.unpack(f"<{code}", rng.randbytes(struct.calcsize(code)))[0]
    if base == "bool":
        return rng.random() < 0.5
    if base in NUMBERS:
        value = rng.choice([0.0, -0.0, 1.5, -(2.0**60), *([] if finite else [float("inf"), float("nan")])])
        return value if rng.random() < 0.5 else struct.unpack("<f", struct.pack("<f", rng.gauss(0, 1e3)))[0]
    if base == "string":
        return rng.choice(_STRINGS)
    if base in ("time", "duration"):
        low = 0 if base == "time" else -(2**31)
        return (Time if base == "time" else Duration)(
            rng.randint(low, 2**31 - 1), rng.randint(0, 999_999_999)
        )
    if present is None:
        from pipros.msg import load_message_class

        present = load_message_class(base)()
    return fill_at_random(present, rng, finite=finite)


def serialized(message: Any) -> bytes:
    """Return the serialized message, to compare messages even if they contain NaN."""
    return b"".join(message._to_buffers())
