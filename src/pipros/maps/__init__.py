"""Files of occupancy grids: a picture, and a YAML file that says how to interpret its greys.

Begin with `map_file.py`.
"""
