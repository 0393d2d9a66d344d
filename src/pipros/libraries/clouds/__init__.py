"""Point clouds: their fields as arrays, filters and segmentation as in PCL, and PCD files, with numpy.

The modules `*_node.py`, `filter_nodes.py` and `segmentation_nodes.py` are nodes; the others perform no I/O
except for `pcd_files.py`. Lengths are in metres.
"""
