"""Caches and synchronizers that sort and match messages by timestamp, for the facade `message_filters`.

No module in this package uses sockets or a clock. Timestamps and the current time are in nanoseconds.
"""
