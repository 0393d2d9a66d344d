"""Caches and synchronizers of messages by timestamp, used by the facade `message_filters`.

No module of this package uses sockets or a clock: stamps and the current time are arguments, in nanoseconds.
"""
