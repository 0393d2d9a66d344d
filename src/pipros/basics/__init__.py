"""Names, limits, errors, files, and text received from peers.

Values in, values out. No sockets, no threads.
"""
