"""Images and cameras: encodings, conversions, camera models and calibration files.

`encodings` requires only Python. The modules for images require numpy and raise ImportError without it.
Functions that require OpenCV import it when called (`opencv.opencv`).
"""
