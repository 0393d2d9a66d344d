"""Encodings of image messages, and files of pictures. Only `codecs.py` needs numpy."""
