"""Point clouds: access to fields as numpy arrays, filters and segmentation as in PCL, and PCD files.

The modules `*_nodes.py` contain nodelets and programs, and `inputs.py` subscribes to their inputs. The
other modules perform no I/O. Lengths are in metres.
"""
