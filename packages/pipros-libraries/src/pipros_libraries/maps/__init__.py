"""Read and write maps: an image, and a YAML file that defines the meaning of its grey values.

Start with `map_file.py`.
"""
