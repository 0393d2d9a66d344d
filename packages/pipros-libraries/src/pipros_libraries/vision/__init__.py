"""Images and cameras: conversions between encodings, lens distortion, capture, and calibration files.

The modules for calibration files require only Python. Importing a module for images raises ImportError if
numpy is not installed. The function `opencv.opencv` imports OpenCV when it is called.
"""
