"""Files of occupancy grids: a picture, and a YAML file with the meaning of its grey values.

Start with `map_file.py`.
"""
