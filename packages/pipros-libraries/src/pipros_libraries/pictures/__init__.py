"""Encodings of image messages, and picture files. Only `codecs.py` needs numpy."""
