"""Decode many serialized messages of a type at once, into columns based on numpy arrays. Requires numpy.

A definition is converted to a plan (`plans.py`). `decode.py` follows the plan in all messages at once, with
one read position per message (`cursors.py`).
"""

from __future__ import annotations

from pipros.basics.extras import missing

try:
    import numpy  # noqa: F401  # all modules of this package use it
except ImportError as error:
    raise missing("reading messages in bulk needs numpy", "numpy", error) from error
