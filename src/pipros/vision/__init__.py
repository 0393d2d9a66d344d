"""Images and cameras on numpy: encodings, conversions, camera models, files of calibrations.

`encodings` needs nothing but Python; the other modules need numpy, and say so when it is missing. OpenCV is
imported by what cannot do without it, when it is called (`extras.opencv`).
"""
