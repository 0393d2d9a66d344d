"""Images and cameras with numpy: encodings, conversions, camera models, calibration files.

`encodings` requires only Python. The modules for images require numpy and raise ImportError without it.
Functions that require OpenCV import it when called (`opencv.opencv`).
"""
