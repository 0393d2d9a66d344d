"""Decode many serialized messages of a type at once, into columns based on numpy arrays. Requires numpy.

A definition is converted to a plan (`plans.py`). `decode.py` follows the plan in all messages at once, with
one read position per message (`cursors.py`).
"""
