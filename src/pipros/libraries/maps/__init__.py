"""Files of occupancy grids: an image, and a YAML file with the meaning of its grey values.

Start with `map_file.py`.
"""
