"""Occupancy grids in files: a picture, and a YAML file that says what its greys mean.

Begin with `map_file.py`.
"""
