"""The rosbridge v2 protocol: a pure core, and the servers around it.

`protocol.py` turns the operations of one client into effects; `session.py` carries them out on a node.
"""
