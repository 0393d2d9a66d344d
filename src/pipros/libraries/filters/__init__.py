"""Caches and synchronizers of messages by timestamp, used by the facade `message_filters`.

No module in this package uses sockets or a clock. Timestamps and the current time are in nanoseconds.
"""
