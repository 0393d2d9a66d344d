"""Point clouds: access to fields as numpy arrays, filters and segmentation as in PCL, and PCD files.

The modules `*_nodes.py` are nodes, and `inputs.py` subscribes to their inputs; the others perform no I/O.
Lengths are in metres.
"""
