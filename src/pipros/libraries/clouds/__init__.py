"""Point clouds: their fields as arrays, filters and segmentation as in PCL, and PCD files, with numpy.

The modules `*_nodes.py` are nodes, and `inputs.py` subscribes to their inputs; the others perform no I/O.
Lengths are in metres.
"""
