"""Basic modules: names, limits, errors, files, and the handling of text received from peers."""
