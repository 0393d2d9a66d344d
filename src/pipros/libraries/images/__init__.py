"""Nodelets that process images, with OpenCV: image_proc, stereo_image_proc and depth_image_proc.

`arrays.py`, `pinhole.py`, `bayer.py`, `matching.py` and `depths.py` perform no I/O; the nodelets are in
modules named after them.
"""
