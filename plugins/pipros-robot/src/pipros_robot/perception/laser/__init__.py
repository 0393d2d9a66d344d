"""Laser scans: projection to points, filters, an assembler, and conversion from clouds and depth images.

The modules `*_node.py` are nodes. The others use no topics, but some look up transforms. Lengths are in
metres, angles in radians. Arithmetic has the same precision as in the genuine C++ programs (float32 for
`float`), so that results are equal.
"""
