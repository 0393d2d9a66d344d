"""Laser scans: projection to points, filters, the assembler, and scans from clouds and depth images.

The modules `*_node.py` are nodes; the others perform no I/O. Lengths are in metres, angles in radians.
Arithmetic has the precision of the genuine C++ programs (float32 where they use `float`), so that results
are equal.
"""
