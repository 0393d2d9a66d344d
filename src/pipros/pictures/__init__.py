"""Image message encodings and picture files. Only `codecs.py` needs numpy."""
