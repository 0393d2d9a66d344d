"""Nodelets that process images with numpy and OpenCV: image_proc, stereo_image_proc and depth_image_proc.

`arrays.py`, `bayer.py`, `clouds.py`, `depths.py`, `matching.py` and `pinhole.py` perform no I/O. `ports.py`
handles image topics; the other modules contain nodelets and programs.
"""
