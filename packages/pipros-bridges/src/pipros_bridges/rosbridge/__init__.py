"""The rosbridge v2 protocol: a core without I/O, and the servers that use it.

`protocol.py` translates a client's operations into effects; `session.py` applies the effects to a node.
"""
