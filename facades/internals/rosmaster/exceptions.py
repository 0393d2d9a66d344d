"""`rosmaster.exceptions`."""


class InternalException(Exception):
    """Internal error of the master, such as an invalid registration type."""
