"""Names, limits, errors, files, and text received from peers.

These modules take values and return values; they use no sockets and no threads.
"""
