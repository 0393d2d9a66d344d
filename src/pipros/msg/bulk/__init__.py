"""Decode many serialized messages of a type at once, to columns of numpy arrays. Needs numpy.

Definitions become plans (`plans.py`), which positions in joined messages follow (`cursors.py`, `decode.py`).
"""
