"""Caches and synchronizers of messages by their time stamps, which the facade `message_filters` offers.

Nothing here has a socket or a clock: stamps and the time are given, as nanoseconds.
"""
